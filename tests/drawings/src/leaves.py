"""leaves.svg: rows of leaves with veins, Bezier curves, on an A4 landscape page (millimetres): thousands of vertices.

Usage: python3 leaves.py > leaves.svg
"""
import math

print('<svg xmlns="http://www.w3.org/2000/svg" width="297mm" height="210mm" viewBox="0 0 297 210">')
print('<g fill="none" stroke="black" stroke-width="0.3">')
for row in range(5):
    for column in range(8):
        x, y = 24 + 36 * column + 8 * (row % 2), 28 + 40 * row
        turn = 25 * math.sin(1.3 * column + 0.7 * row)
        print(f'<g transform="translate({x} {y}) rotate({turn:.2f})">')
        print('<path d="M0,14 C-14,4 -10,-10 0,-16 C10,-10 14,4 0,14 Z"/>')
        print('<path d="M0,20 C1,8 -1,-4 0,-14"/>')
        for vein in range(5):
            v, w = 9 - 5 * vein, 7.5 - 1.2 * abs(vein - 1)
            for side in (-1, 1):
                print(f'<path d="M0,{v} C{side * 2},{v - 3} {side * w * 0.7:.2f},{v - 3} {side * w:.2f},{v - 6}"/>')
        print("</g>")
print("</g></svg>")
