while pgrep -f 'docs_2/out/glass.png' >/dev/null; do sleep 2; done
[ -e /tmp/docs_2/out/glass.png ] && [ ! -e /tmp/docs_2/out/glass.png.film ] && touch /tmp/docs_2/out/glass.png.done
bash /tmp/docs_2/runall2.sh
