# SPDX-License-Identifier: LGPL-2.1-or-later
# gnuplot -e "tables='build/benchmarks'; pictures='docs/pictures'" tests/benchmarks/silhouette.gp
set datafile separator ','
set datafile missing NaN  # rows of other methods lie between; lines run over them
set terminal pngcairo size 900,560 font 'sans,11'
set key outside right
set grid

set output pictures.'/silhouette-blur-time.png'
set title 'Blur of a 1920x1080 mask: time over sigma'
set xlabel 'sigma, px'; set ylabel 'best time, ms'; set logscale xy
plot for [m in "fir box recursive"] tables.'/silhouette_blur.csv' \
       using 1:(strcol(2) eq m ? $3 : NaN) with linespoints title m, \
     tables.'/silhouette_blur.csv' using 1:(strcol(2) eq "OpenCV u8" ? $3 : NaN) with linespoints title 'OpenCV u8', \
     tables.'/silhouette_blur.csv' using 1:(strcol(2) eq "OpenCV f32" ? $3 : NaN) with linespoints title 'OpenCV f32'

set output pictures.'/silhouette-blur-error.png'
set title 'Blur of a 1920x1080 mask: largest error against the exact Gaussian, over time'
set xlabel 'best time, ms'; set ylabel 'largest error, grey levels'
plot for [m in "fir box recursive"] tables.'/silhouette_blur.csv' \
       using (strcol(2) eq m ? $3 : NaN):4 with points pointsize 1.5 title m, \
     tables.'/silhouette_blur.csv' using (strcol(2) eq "OpenCV u8" ? $3 : NaN):4 with points pointsize 1.5 title 'OpenCV u8', \
     tables.'/silhouette_blur.csv' using (strcol(2) eq "OpenCV f32" ? $3 : NaN):4 with points pointsize 1.5 title 'OpenCV f32'

set output pictures.'/silhouette-tolerance.png'
set title 'Smooth star, R = 250 px: error of the polygon over its vertices'
set xlabel 'vertices'; set ylabel 'mean absolute error, px'
plot tables.'/silhouette_tolerance.csv' using (strcol(1) eq "smooth star R=250" && strcol(3) eq "ours" ? $4 : NaN):5 \
       with linespoints title 'contourfind', \
     tables.'/silhouette_tolerance.csv' using (strcol(1) eq "smooth star R=250" && strcol(3) eq "OpenCV" ? $4 : NaN):5 \
       with linespoints title 'OpenCV approxPolyDP'
