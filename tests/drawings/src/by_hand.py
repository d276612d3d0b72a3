"""The small files of this folder that are written by hand. Usage: python3 by_hand.py (writes beside this folder)."""
import math
import pathlib

FILES = {
    "centre-origin.hpgl": b"IN;SP1;PU-4000,-2500;PD4000,-2500,4000,2500,-4000,2500,-4000,-2500;PU;"
    b"PU-4000,-2500;PD4000,2500;PU-4000,2500;PD4000,-2500;PU0,0;CI1000;PU;SP0;\n",
    "out-of-reach.hpgl": b"IN;SP1;PU400,400;PD2400,400;PU800,800;PD800,40000;PU1200,1200;PD2400,2400;PU;SP0;\n",
    "spaces-nosemi.hpgl": b"in sp1 pu400 400 pd2400 400 2400 2400\nPD400 2400PD400 400PU\nSP2PA1000+1000PD1800+1000-200+1800PU SP0",
    "relative.hpgl": b"IN;SP1;PU400,400;PD;PR1000,0,0,1000,-1000,0,0,-1000;PU;PR2000,0;PD500,500,500,-500;PA;PU400,3000;PD2400,3000;PU;\n",
    "scaled.hpgl": b"IN;IP400,400,6400,4400;SC0,30,0,20;SP1;PU0,0;PD30,0,30,20,0,20,0,0;PU15,10;CI5;SC-1,1,-1,1,1;PU0,0;CI0.5;"
    b"SC;PU400,5000;PD6400,5000;PU;IN;RO90;SP2;PU400,400;PD4000,400,4000,1200;PU;\n",
    "arcs.hpgl": b"IN;SP1;PU2000,2000;CI800;PU4000,2000;PD;AA4500,2000,180;AR0,-500,90;PU6000,1000;PD;AT6500,1500,7000,1000;"
    b"PU6000,3000;EW700,30,100;PU2000,4000;PD3000,4000;AA3000,4500,90;PD3500,6000;PU;\n",
    "dots.hpgl": b"IN;SP1;" + b"".join(b"PU%d,%d;PD;PU;" % (400 + 200 * i, 400 + 200 * j) for i in range(6) for j in range(4)) + b"SP0;\n",
    "labels.hpgl": b"IN;SP1;SI0.4,0.6;PU400,4000;LBplain text\x03;DT#;PU400,3000;LBother end#;DT;DI0.7,0.7;PU400,800;LBslanted\x03;PU;SP0;\n",
    "pens.hpgl": b"IN;" + b"".join(
        b"SP%d;PU%d,400;PD%d,4400;PU%d,4400;PD%d,400;" % (1 + k % 4, 400 + 300 * k, 400 + 300 * k, 550 + 300 * k, 550 + 300 * k)
        for k in range(12)) + b"PU;SP0;\n",
    "spiral.hpgl": b"IN;SP1;PU4000,4000;PD" + b",".join(
        b"%d,%d" % (round(4000 + 4 * k * math.cos(k / 9)), round(4000 + 4 * k * math.sin(k / 9))) for k in range(1, 800)) + b";PU;SP0;\n",
}
for name, content in FILES.items():
    (pathlib.Path(__file__).parent.parent / name).write_bytes(content)
