# One measurement as a CSV row, from the service's log (request id, status, compute ms) and the clients' times (request id, ms).
# Of masks: total, compute, and total less compute, which is what the service adds. Of refusals: the total.
function quantile(values, n, q) {
    if (n == 0) return ""
    return sprintf("%.3f", values[int(1 + q * (n - 1) + 0.5)])
}
function sort(values, n,    gap, i, j, t) {
    for (gap = int(n / 2); gap > 0; gap = int(gap / 2))
        for (i = gap + 1; i <= n; ++i) {
            t = values[i]
            for (j = i; j > gap && values[j - gap] > t; j -= gap) values[j] = values[j - gap]
            values[j] = t
        }
}
FILENAME ~ /served$/ { status[$1] = $2; compute_of[$1] = $3; next }
!($1 in status) { next } # not finished when wrk ended
status[$1] == 200 { ++masks; total[masks] = $2 + 0; compute[masks] = compute_of[$1] + 0; outside[masks] = $2 - compute_of[$1] }
status[$1] == 503 { refusal[++refused] = $2 + 0 }
status[$1] != 200 && status[$1] != 503 { print "join: a request had status " status[$1] > "/dev/stderr"; exit 1 }
END {
    sort(total, masks); sort(compute, masks); sort(outside, masks); sort(refusal, refused)
    printf "%s,%d,%.1f,%s,%s,%s,%s,%s,%s,%s,%s,%d,%s,%s\n", taken, masks, masks / taken,
        quantile(total, masks, 0), quantile(total, masks, 0.5), quantile(total, masks, 0.99),
        quantile(compute, masks, 0), quantile(compute, masks, 0.5),
        quantile(outside, masks, 0), quantile(outside, masks, 0.5), quantile(outside, masks, 0.99),
        refused, quantile(refusal, refused, 0.5), quantile(refusal, refused, 0.99)
}
