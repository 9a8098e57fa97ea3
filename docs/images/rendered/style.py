import re,sys
for f in sys.argv[1:]:
    code=False
    for n,l in enumerate(open(f),1):
        if l.startswith('```'): code=not code
        if code or l.startswith('|') : continue
        if len(l.rstrip())>150: print(f'{f}:{n}: {len(l)} cols')
        for w in r'\btold\b|\btells?\b|\bhears?\b|\bknows\b|\bglow|so many|what there is|goes on from|\bnobody\b|likewise|\bwhoever\b|\bhow much\b'.split('|'):
            if re.search(w,l): print(f'{f}:{n}: [{w}] {l.strip()[:100]}')
        if re.match(r'^(What|Whether|How|Those|Likewise) ',l): print(f'{f}:{n}: begins {l.strip()[:80]}')
