# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the tables that tests/benchmarks/picture.sh makes:
#   gnuplot -e "tables='build/benchmarks'; pictures='docs/pictures'" tests/benchmarks/picture_plots.gp
set datafile separator ','
set terminal pngcairo size 900,600 font 'DejaVu Sans,11'
set grid
set style data linespoints
set xlabel 'processor time of a frame, ms'
set logscale xy

of(backend, value) = strcol(1) eq backend ? value : NaN

set output pictures.'/picture-shadow.png'
set title "The shadow: hard, fast, good and best, 1280×720"
set ylabel 'error of the share of light (RMS) against 1,024 rays'
plot tables.'/picture_shadow.csv' using (of('processor', $3)):4 pt 7 lc 1 title 'processor', \
     '' using (of('processor', $3)):4:2 with labels offset 0,1 notitle, \
     '' using (of('gl', $3)):4 pt 5 lc 2 title 'OpenGL, software rasteriser', \
     '' using (of('gl', $3)):4:2 with labels offset 0,-1 notitle

# With `good`: the number of samples at edges.
edges(backend, value) = strcol(1) eq backend && strcol(2) eq 'good' ? value : NaN
set output pictures.'/picture-mirror.png'
unset logscale y
set title "The mirror's image and the whole picture: 1, 2, 4 and 8 samples a pixel at edges, 960×540"
set ylabel 'PSNR against a ray tracer, dB'
plot tables.'/picture_mirror.csv' using (edges('processor', $4)):5 pt 7 lc 1 title 'mirror, processor', \
     '' using (edges('processor', $4)):5:3 with labels offset 0,1 notitle, \
     '' using (edges('processor', $4)):6 pt 6 lc 1 dt 2 title 'whole, processor', \
     '' using (edges('gl', $4)):5 pt 5 lc 2 title 'mirror, OpenGL', \
     '' using (edges('gl', $4)):6 pt 4 lc 2 dt 2 title 'whole, OpenGL'
