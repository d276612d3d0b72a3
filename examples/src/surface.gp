# surface.hpgl: a rippled surface with hidden lines removed, gnuplot's plotter terminal.
# Usage: gnuplot surface.gp > ../surface.hpgl
set terminal hpgl 4
set size 0.8, 1
set isosamples 36
set hidden3d
set view 58, 35
set xyplane 0.1
set title "sin r / r"
unset key
set border 31
splot [-9:9] [-9:9] sin(sqrt(x*x + y*y)) / sqrt(x*x + y*y + 0.01) linetype 2
