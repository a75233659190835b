# SPDX-License-Identifier: LGPL-2.1-or-later
# Draws the tables that tests/benchmarks/picture.sh makes:
#   gnuplot -e "tables='build/benchmarks'; pictures='docs/pictures'" tests/benchmarks/picture_plots.gp
set datafile separator ','
set terminal pngcairo size 900,600 font 'DejaVu Sans,11'
set grid
set style data linespoints
set xlabel 'processor time of a frame, ms'
set logscale xy

# Of one lamp.
of(backend, value) = strcol(1) eq backend && $7 == 1 ? value : NaN

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
set key at graph 0.98, 0.6
set yrange [39:48]
set title "The mirror's image and the whole picture: 1, 2, 4 and 8 samples a pixel at edges, 960×540"
set ylabel 'PSNR against a ray tracer, dB'
plot tables.'/picture_mirror.csv' using (edges('processor', $4)):5 pt 7 lc 1 title 'mirror, processor', \
     '' using (edges('processor', $4)):5:3 with labels offset 0,1 notitle, \
     '' using (edges('processor', $4)):6 pt 6 lc 1 dt 2 title 'whole, processor', \
     '' using (edges('gl', $4)):5 pt 5 lc 2 title 'mirror, OpenGL', \
     '' using (edges('gl', $4)):6 pt 4 lc 2 dt 2 title 'whole, OpenGL'

# At a camera's place; points: 1, 2, 4 and 8 samples a pixel.
set datafile separator tab
place(subject, soft, degrees, value) = \
  strcol(1) eq subject && $2 == 1.5 && $3 == degrees && $4 == soft ? value : NaN
set output pictures.'/picture-edges.png'
set title "Outlines, 1, 2, 4 and 8 samples a pixel: hair and a smooth figure, at a camera's place"
set ylabel 'RMS error in the 8 px around the outline, levels'
set yrange [0:*]
set key default
set key inside left bottom
plot tables.'/edges.tsv' using (place('hairy', 0, 0.0, $6)):8 pt 6 lc 1 dt 2 title 'hair, polygons', \
     '' using (place('hairy', 1, 0.0, $6)):8 pt 7 lc 1 title 'hair, soft', \
     '' using (place('figure', 0, 0.0, $6)):8 pt 4 lc 2 dt 2 title 'smooth, polygons', \
     '' using (place('figure', 1, 0.0, $6)):8 pt 5 lc 2 title 'smooth, soft'

set output pictures.'/picture-light.png'
set title "scenesrc's light: the first of a live stream, then by the distance between points"
set xlabel 'processor time of the light, s'
set ylabel 'PSNR against path tracing, dB'
set yrange [30:46]
set key left top
plot tables.'/scenesrc_light.tsv' every ::1 using 4:6 pt 7 lc 1 title 'light', \
     '' every ::1 using 4:6:(strcol(1)[1:5] eq 'first' ? 'first' : sprintf('%g m', $2)) with labels offset 0,1 notitle
