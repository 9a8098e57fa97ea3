while ps -eo args | grep -q '[r]unall2.sh'; do sleep 3; done
rm -f /tmp/docs_2/out/lights_*.done /tmp/docs_2/out/glass.png.done /tmp/docs_2/out/cameras_lens.png.done
bash /tmp/docs_2/runall2.sh
