# rend.sh SPP name...
s=$1; shift; cd /tmp/docs_2/r; fs=
for m in "$@"; do nice -n 5 /tmp/bin/pathtracer -q -t 1 -s $s --restart --allow-folder /work/main/scenes -f ${m##*/}.png /work/main/docs/scenes/$m.json || echo FAIL $m; fs="$fs ${m##*/}.png"; done
../v/bin/python ../sheet.py sheet.png ${COLS:-4} $fs
