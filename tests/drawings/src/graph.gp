# gnuplot-pcl5.pcl: curves and words in HP-GL/2 inside PCL.  Usage: gnuplot graph.gp > ../gnuplot-pcl5.pcl
set terminal pcl5
set samples 160
set title "damped"
plot [0:12] exp(-x/5)*cos(3*x), exp(-x/5), -exp(-x/5)
