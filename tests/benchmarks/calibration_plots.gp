# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the table of tests/benchmarks/calibration_benchmark.cpp:
#   gnuplot -e "tables='build/benchmarks'; pictures='docs/pictures'" tests/benchmarks/calibration_plots.gp
set datafile separator ','
set datafile missing NaN
set terminal pngcairo size 1200,700 font 'DejaVu Sans,10'
set output pictures.'/calibration.png'
set grid
set logscale xy
set xrange [.08:1.25]
set xtics (.1, .25, .5, 1)
set style data linespoints
set key top left
set xlabel 'noise of a corner, px'
table = tables.'/calibration.csv'
set multiplot layout 2,2 title 'Calibration in a ring of 4 m: root mean square error of a camera'
set ylabel 'centre, mm'
plot for [n in '4 8 16'] table using 2:($1 == n ? $4 : NaN) every ::1 pt 7 title n.' cameras', \
     table using 2:($1 == 8 ? $5 : NaN) every ::1 dt 2 lc 'black' with lines title '8: what it says itself'
set key off
set ylabel 'rotation, degrees'
plot for [n in '4 8 16'] table using 2:($1 == n ? $6 : NaN) every ::1 pt 7
set ylabel 'focal length, %'
plot for [n in '4 8 16'] table using 2:($1 == n ? $7 : NaN) every ::1 pt 7
set ylabel 'distortion k1'
plot for [n in '4 8 16'] table using 2:($1 == n ? $8 : NaN) every ::1 pt 7
unset multiplot
