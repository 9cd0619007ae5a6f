# Plots of the Soft Shadow Maps study, one a figure of the paper. Usage: gnuplot -e "csv='out/bench'; out='docs/pictures'" bench/plots.gp
# Columns of the CSV: 2 scene, 4 settings, 5 parameter, 6 mean absolute error over shadow pixels, 13 median shade time, 15 kernel time.
set datafile separator ","
set terminal pngcairo size 900,520 font "DejaVu Sans,11"
set key outside right top
set grid
rows(file, scene, setting) = sprintf("< grep '^%s,%s,soft_shadow_map,' %s/%s.csv | grep '%s'", file, scene, csv, file, setting)

set style line 1 lc rgb "#1f77b4" lw 2 pt 7 ps 0.8
set style line 2 lc rgb "#1f77b4" lw 2 pt 6 ps 0.8 dt 2
set style line 3 lc rgb "#d62728" lw 2 pt 7 ps 0.8
set style line 4 lc rgb "#d62728" lw 2 pt 6 ps 0.8 dt 2
set style line 5 lc rgb "#2ca02c" lw 2 pt 6 ps 0.8 dt 2

set ylabel "mean absolute error over shadow pixels"
set yrange [0:*]

do for [figure in "resolution light_size lateral vertical"] {
    set output sprintf("%s/soft_shadow_map_%s.png", out, figure)
    set xlabel figure eq "resolution" ? "occluder map, texels a side" : \
               figure eq "light_size" ? "side of the light (the occluder is 2 wide, 5 away; the plane 8)" : \
               figure eq "lateral" ? "occluder's place beside the light's axis" : "height of the occluder's centre above the plane (light at 8)"
    plot rows(figure, "bunny", "sides=both") using 5:6 with linespoints ls 1 title "bunny, two-sided", \
         rows(figure, "bunny", "sides=front") using 5:6 with linespoints ls 2 title "bunny, one-sided", \
         rows(figure, "horse", "sides=both") using 5:6 with linespoints ls 3 title "horse, two-sided", \
         rows(figure, "horse", "sides=front") using 5:6 with linespoints ls 4 title "horse, one-sided", \
         rows(figure, "square", "sides=front") using 5:6 with linespoints ls 5 title "square"
}

set output sprintf("%s/soft_shadow_map_light_and_resolution.png", out)
set xlabel "side of the light"
set logscale x
plot for [n in "64 128 256 512"] sprintf("< grep '^light_size_%s,' %s/light_size.csv", n, csv) using 5:6 with linespoints lw 2 title n." texels a side"
unset logscale x

set output sprintf("%s/soft_shadow_map_texels.png", out)
set xlabel "occluder texels (thousands)"
set ylabel "shade time, ms (median)"
plot rows("texels", "bunny", "sides=both") using ($5/1000):13 with linespoints ls 1 title "two-sided", \
     rows("texels", "bunny", "sides=front") using ($5/1000):13 with linespoints ls 2 title "one-sided"

set output sprintf("%s/soft_shadow_map_accumulators.png", out)
set xlabel "occluder map, texels a side"
set ylabel "mean absolute error over shadow pixels"
set logscale xy
set yrange [0.01:1]
plot rows("accumulators", "bunny", "accumulator=binary16") using 5:6 with linespoints ls 3 title "binary16", \
     rows("accumulators", "bunny", "accumulator=binary32") using 5:6 with linespoints ls 1 title "binary32", \
     rows("accumulators", "bunny", "accumulator=compensated") using 5:6 with linespoints ls 5 title "compensated"

set output sprintf("%s/soft_shadow_map_trade.png", out)
set xlabel "shade time, ms (median)"
set ylabel "root mean square error over shadow pixels"
set yrange [*:*]
plot rows("bunny", "bunny", "sides=both") using 13:7 with linespoints ls 1 title "soft shadow map, two-sided, 64 to 512 texels", \
     sprintf("< grep ',ray_traced,' %s/bunny.csv | grep 'adaptive=false'", csv) using 13:7 with linespoints ls 3 title "Embree, 16 to 1024 rays", \
     sprintf("< grep ',ray_traced,' %s/bunny.csv | grep 'adaptive=true'", csv) using 13:7 with linespoints ls 4 title "Embree, adaptive"
