# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the table of tests/benchmarks/imagehull_benchmark.cpp:
#   gnuplot -e "tables='build/benchmarks'; pictures='docs/pictures'" tests/benchmarks/imagehull_plots.gp
set datafile separator ','
set terminal pngcairo size 1200,700 font 'DejaVu Sans,10'
set output pictures.'/image-based.png'
set grid
set style data linespoints
set key top left
table = tables.'/imagehull.csv'

of(what, method, value) = strcol(1) eq what && strcol(2) eq method ? value : NaN
# A row of another method stands between two of one.
set datafile missing NaN

set multiplot layout 2,3 title 'From contours to a drawn frame: image-based hull, hull and refined surface'
set yrange [0:*]
set ylabel 'processor time of a frame, ms'
set xlabel 'cameras'
plot table using 3:(of('cameras', 'image-based', $7 + $8)) pt 7 lc 1 title 'image-based', \
     '' using 3:(of('cameras', 'hull', $7 + $8)) pt 5 lc 2 title 'hull', \
     '' using 3:(of('cameras', 'refined', $7 + $8)) pt 9 lc 4 title 'refined, fast'
set xlabel 'contour vertices of five cameras'
set key off
plot table using 5:(of('tolerance', 'image-based', $7 + $8)) pt 7 lc 1, \
     '' using 5:(of('tolerance', 'hull', $7 + $8)) pt 5 lc 2, \
     '' using 5:(of('tolerance', 'refined', $7 + $8)) pt 9 lc 4
set xlabel 'rows of the picture'
plot table using 6:(of('size', 'image-based', $7 + $8)) pt 7 lc 1, \
     '' using 6:(of('size', 'hull', $7 + $8)) pt 5 lc 2, \
     '' using 6:(of('size', 'refined', $7 + $8)) pt 9 lc 4
set yrange [*:*]
set ylabel 'PSNR half way between cameras, dB'
set xlabel 'cameras'
plot table using 3:(of('cameras', 'image-based', $10)) pt 7 lc 1, \
     '' using 3:(of('cameras', 'hull', $10)) pt 5 lc 2, \
     '' using 3:(of('cameras', 'refined', $10)) pt 9 lc 4
set xlabel 'contour vertices of five cameras'
plot table using 5:(of('tolerance', 'image-based', $10)) pt 7 lc 1, \
     '' using 5:(of('tolerance', 'hull', $10)) pt 5 lc 2, \
     '' using 5:(of('tolerance', 'refined', $10)) pt 9 lc 4
set ylabel 'IoU half way between cameras'
set xlabel 'cameras'
plot table using 3:(of('cameras', 'image-based', $9)) pt 7 lc 1, \
     '' using 3:(of('cameras', 'hull', $9)) pt 5 lc 2, \
     '' using 3:(of('cameras', 'refined', $9)) pt 9 lc 4
unset multiplot
