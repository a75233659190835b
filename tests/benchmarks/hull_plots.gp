# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the tables of hull_benchmark and hull_error_benchmark:
# tests/benchmarks/hull.sh runs all of it.
#   gnuplot -e "tables='build/tests/benchmarks'; pictures='docs/pictures'" tests/benchmarks/hull_plots.gp
set datafile separator ','
set terminal pngcairo size 900,600 font 'DejaVu Sans,11'
set grid
set key left top
set style data linespoints

set output pictures.'/hull-growth.png'
set multiplot layout 1,2 title 'Time of one hull, one thread'
set logscale xy
set xlabel 'contour vertices, 8 cameras'
set ylabel 'ms'
plot tables.'/hull_growth.csv' using (strcol(1) eq 'vertices' ? $3 : NaN):4 pt 7 lc 1 title 'measured', \
     x / 200 lc 'grey' dt 2 with lines title 'linear'
set xlabel 'cameras, one grid step of 8 px each'
plot tables.'/hull_growth.csv' using (strcol(1) eq 'cameras' ? $2 : NaN):4 pt 7 lc 1 title 'measured', \
     x lc 'grey' dt 2 with lines title 'linear', x * x / 8 lc 'grey' dt 3 with lines title 'quadratic'
unset multiplot

set output pictures.'/hull-peers.png'
unset logscale
set logscale y
set style data histograms
set style histogram clustered gap 1
set style fill solid 0.8
set xtics rotate by -40 font ',9' noenhanced
unset xlabel
set ylabel 'ms, one thread'
set key right top
set title 'The same silhouettes, the same run'
plot tables.'/hull_peers.csv' using 4:xtic(1) every ::1 title 'polyhull', \
     '' using 8 every ::1 title 'voxels, 128 along the longest side', \
     '' using 6 every ::1 title 'CGAL corefinement (EPICK)'

set output pictures.'/hull-error.png'
set style data linespoints
unset title
set xtics norotate font ',11' enhanced
set key right top
set multiplot layout 2,2 title 'Error against time: a body 1.67 m tall seen by 8 cameras (labels: tolerance in px, voxels along the height)'
set logscale x
unset logscale y
set xlabel 'ms'
method(name, column) = strcol(1) eq name ? column : NaN
array label[4] = ['1 - IoU with the body, own cameras', '1 - IoU, cameras left out', \
                  'Hausdorff distance to the body, mm', 'volume / true volume']
quantity(panel) = panel == 1 ? 1 - column(6) : panel == 2 ? 1 - column(7) : panel == 3 ? column(10) : column(8) / column(9)
do for [panel = 1:4] {
  set ylabel label[panel]
  unset logscale y
  if (panel <= 2) { set logscale y }
  plot tables.'/hull_error.csv' using 4:(method('exact', quantity(panel))) pt 7 lc 1 title 'exact hull', \
       '' using 4:(method('exact', quantity(panel))):2 with labels offset 0,0.8 font ',7' notitle, \
       '' using 4:(method('voxels', quantity(panel))) pt 5 lc 2 title 'voxels', \
       '' using 4:(method('voxels', quantity(panel))):2 with labels offset 0,0.8 font ',7' notitle
}
unset multiplot

set output pictures.'/hull-slivers.png'
set key outside right top font ',9'
set logscale x
set format x '%g'
unset logscale y
set xlabel 'max-deviation, relative to the diagonal of the hull (0 drawn at 1e-7)'
set ylabel 'slivers, % of the triangles'
set title 'Slivers (height below 0.2 % of the longest edge) against max-deviation'
scenes = system("cut -d, -f1 ".tables."/hull_slivers.csv | grep -v '^scene' | sort -u")
set yrange [0:6]
plot for [scene in scenes] tables.'/hull_slivers.csv' \
  using ($2 > 0 ? $2 : 1e-7):(strcol(1) eq scene ? $5 : NaN) title scene noenhanced, \
  1 lc 'black' dt 2 with lines title '1 %'
