"""knot.svg: one closed curve of many turns and a few smooth waves, dense vertices once exported (millimetres, 150 x 150).

Usage: python3 knot.py > knot.svg
"""
import math

points = []
for k in range(241):
    t = 2 * math.pi * k / 240
    r = 45 + 20 * math.cos(7 * t / 2 * 2)
    points.append((75 + r * math.cos(3 * t), 75 + r * math.sin(3 * t)))
print('<svg xmlns="http://www.w3.org/2000/svg" width="150mm" height="150mm" viewBox="0 0 150 150">')
print('<g fill="none" stroke="black" stroke-width="0.3"><path d="M' + " L".join(f"{x:.3f},{y:.3f}" for x, y in points) + ' Z"/>')
for wave in range(6):
    y = 12 + 25 * wave
    print(f'<path d="M5,{y} C40,{y - 25} 60,{y + 25} 75,{y} S120,{y - 20} 145,{y}"/>')
print("</g></svg>")
