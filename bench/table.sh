#!/bin/sh
# A Markdown table from a bench's CSV: bench/table.sh FILE.csv [PATTERN...]   (only rows that match every PATTERN)
set -eu
file=$1
shift
[ -r "$file" ] || { echo "bench/table.sh: $file is missing: run bench/run.sh" >&2; exit 1; }
rows=$(grep -v '^#' "$file" | tail -n +2)
for pattern in "$@"; do rows=$(printf '%s\n' "$rows" | grep -e "$pattern"); done
echo '| technique | settings | parameter | MAE shadow | RMSE shadow | bias | largest | 99 % | prepare ms | shade ms min / median / max | kernel ms | pairs or rays a second | MiB on device |'
echo '| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |'
printf '%s\n' "$rows" | awk -F, '
    # Settings that are at their defaults say nothing.
    { s = " " $4 " "
      gsub(" t_from=light t=0[.]05 ", " ", s)
      n = split("preset=default preset=paper tolerance=0 layers=0 visibility=sum silhouettes=object silhouettes=centre falloff=sinusoidal two_sided=false placement=uniform projection_centre=light prefilter=summed_area storage=normalized16 combine=layered_max layers=4 leak_fix=false self_shadow=auto coverage=analytic overlap=sum light_splits=1 table=32 lookup=quadrilinear buffer=binary32 culling=tight smooth=false corner_wedges=0 resolution=0 reduction=area accumulator=binary32 bias=1 project=false project_resolution=512 seed=1 first_samples=16 adaptive=false", d, " ")
      for (i = 1; i <= n; i++) gsub(" " d[i] " ", " ", s)
      for (i = 1; i <= n; i++) gsub(" " d[i] " ", " ", s)
      gsub(/^ +| +$/, "", s)
      printf "| %s, %s | %s | %s | %.4f | %.4f | %+.4f | %.3f | %.3f | %.2f | %.2f / %.2f / %.2f | %.2f | %.3g | %.1f |\n",
             $3, $2, s, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $17, $18 / 1048576 }'
