cd /work/main
while read -r l; do o=$(echo "$l" | sed 's/.*-f \([a-z_]*\.png\).*/\1/'); [ -e /tmp/docs_2/out/$o.done ] && continue
 l2=$(echo "$l" | sed "s#-f #-f /tmp/docs_2/out/#")
 s=$(date +%s); nice -n 5 /tmp/bin/pathtracer -q -t 1 --restart $l2 </dev/null && touch /tmp/docs_2/out/$o.done; echo "$o $(( $(date +%s)-s )) s"; done < /tmp/docs_2/cmds3.txt
