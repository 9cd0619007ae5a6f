#!/bin/sh
# Runs penumbra-server, nginx with nginx.conf and HAProxy with haproxy.cfg, on free ports of loopback and as the user who calls it; sends the
# same requests to each; prints what came back as a table; and compares it with the table of docs/service_hardening.md. Takes about a
# minute. The configurations are the files beside this one; only their ports are replaced.
#
# Exit: 0 all is as the page says, 1 something is not, 2 a program is missing.
#
# The service is $PENUMBRA_SERVER, or else `penumbra-server` on the path. Needs nginx (nginx-light), haproxy, python3.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
server=${PENUMBRA_SERVER:-penumbra-server}
PATH=$PATH:/usr/sbin:/sbin # where Debian has both proxies
for program in "$server" nginx haproxy python3; do
    command -v "$program" >/dev/null || { echo "try_proxies: no program $program" >&2; exit 2; }
done

work=$(mktemp -d)
processes=
trap 'for process in $processes; do kill "$process" 2>/dev/null || true; done; wait; rm -rf "$work"' EXIT
chmod 711 "$work" # nginx's workers are another user's when root calls

# --- The service, as an operator would start it behind a proxy
token=try-proxies-$(od -An -N16 -tx1 /dev/urandom | tr -d ' \n')
: >"$work/service.log"
PENUMBRA_SERVER_TOKEN=$token "$server" --port 0 --names gateway.example 2>"$work/service.log" &
service=$!
processes=$service
until grep -qx ready "$work/service.log"; do
    kill -0 "$service" 2>/dev/null || { cat "$work/service.log" >&2; exit 1; }
    sleep 0.1
done
port=$(sed -n 's/.*listening on .* port \([0-9]*\).*/\1/p' "$work/service.log")

# --- The proxies
free_ports='
import socket
all = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
print(*[one.getsockname()[1] for one in all])'
ports=$(python3 -c "$free_ports")
nginx_port=${ports% *} haproxy_port=${ports#* }

# replaced FILE: with our ports; fails when there was nothing to replace.
replaced() {
    sed -e "s/127\.0\.0\.1:8080/127.0.0.1:$port/" -e "s/^    listen 80;/    listen 127.0.0.1:$nginx_port;/" \
        -e "s/^    bind :80\$/    bind 127.0.0.1:$haproxy_port/" "$here/$1" >"$work/$1"
    [ "$(diff "$here/$1" "$work/$1" | grep -c '^>')" = 2 ] || { echo "try_proxies: $1: expected one port to listen on and one to go to" >&2; exit 1; }
}
replaced nginx.conf
replaced haproxy.cfg

# What Debian's own nginx.conf has around conf.d, and places that a user may write to.
cat >"$work/nginx_main.conf" <<END
daemon off;
pid $work/nginx.pid;
error_log $work/nginx.log;
events { worker_connections 768; }
http {
    access_log off;
    gzip on;
    client_body_temp_path $work/nginx_body;
    proxy_temp_path $work/nginx_proxy;
    fastcgi_temp_path $work/nginx_fastcgi;
    uwsgi_temp_path $work/nginx_uwsgi;
    scgi_temp_path $work/nginx_scgi;
    include $work/nginx.conf;
}
END
nginx -e "$work/nginx.log" -c "$work/nginx_main.conf" 2>>"$work/nginx.log" &
processes="$processes $!"
printf 'global\n    maxconn 500\n' >"$work/haproxy_global.cfg"
haproxy -db -f "$work/haproxy_global.cfg" -f "$work/haproxy.cfg" >"$work/haproxy.log" 2>&1 &
processes="$processes $!"

# --- The requests
python3 -B "$here/try_proxies.py" --token "$token" --service-process "$service" --docs "$here/../../docs/service_hardening.md" \
    "direct=$port" "nginx=$nginx_port" "HAProxy=$haproxy_port" || {
    status=$?
    tail -n 5 "$work/nginx.log" "$work/haproxy.log" >&2
    exit $status
}
