# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the table of tests/benchmarks/cells_benchmark.cpp:
#   gnuplot -e "tables='build/benchmarks'; pictures='docs/pictures'" tests/benchmarks/cells_plots.gp
set datafile separator ','
set terminal pngcairo size 1500,900 font 'DejaVu Sans,10'
set output pictures.'/cells.png'
set grid
set style data linespoints
table = tables.'/cells.csv'

of(rig, method, value) = strcol(1) eq rig && strcol(2) eq method ? value : NaN
# A row of another method stands between two of one.
set datafile missing NaN
set logscale x
set xlabel 'processor time from contours to a textured frame, ms'
array errors[9]
errors[7] = 'mean distance to the body, mm'
errors[8] = 'IoU half way between cameras'
errors[9] = 'PSNR half way between cameras, dB'

set multiplot layout 2,3 title 'Error over time as cells get smaller: 4 cameras above, 8 below'
do for [rig in '4 8'] {
  do for [n = 7:9] {
    set ylabel sprintf('%s cameras: %s', rig, errors[n])
    if (n == 8 && rig eq '4') { set key center right } else { set key off }
    plot table using 6:(of(rig, 'voxels', column(n))) pt 5 lc 7 title 'voxels, 40 to 7 mm', \
      '' using 6:(of(rig, 'fast', column(n))) pt 9 lc 4 title 'refined, fast, 40 to 8 mm', \
      '' using 6:(of(rig, 'good', column(n))) pt 11 lc 1 title 'refined, good, 40 to 8 mm', \
      '' using 6:(of(rig, 'hull', column(n))) with points pt 7 ps 1.6 lc 2 title 'exact hull', \
      '' using 6:(n > 7 ? of(rig, 'image-based', column(n)) : NaN) with points pt 13 ps 1.8 lc 8 title 'image-based'
  }
}
unset multiplot
