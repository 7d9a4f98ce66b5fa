#!/bin/sh
# A browser that draws without a graphics card, at low priority: it must not take the processor from a drone
# in real time. Chromium raises its own priority where it may, as root, so that right is taken from it.
if [ "$(id -u)" = 0 ] && command -v setpriv >/dev/null; then
    exec nice -n 10 setpriv --bounding-set=-sys_nice --inh-caps=-sys_nice "$POLITE_BROWSER" "$@"
fi
exec nice -n 10 "$POLITE_BROWSER" "$@"
