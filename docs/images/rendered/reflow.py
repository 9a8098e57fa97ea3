import re,sys,textwrap
W=128
def reflow(t):
    out=[];buf=[];code=False
    def flush():
        if not buf: return
        first=buf[0]
        m=re.match(r'^(\s*(?:[*-]|\d+\.)\s+)',first)
        ind=m.group(1) if m else ''
        text=' '.join(x.strip() for x in buf); 
        if m: text=text[len(ind.strip())+1:] if text.startswith(ind.strip()) else text
        # protect inline code and keep link urls unbroken (no spaces inside urls)
        toks=re.split(r'(`[^`]*`)',text)
        text=''.join(x.replace(' ','\u0001') if i%2 else x for i,x in enumerate(toks))
        w=textwrap.wrap(text,W,initial_indent=ind,subsequent_indent=' '*len(ind),break_long_words=False,break_on_hyphens=False)
        out.extend(x.replace('\u0001',' ') for x in w); buf.clear()
    for l in t.split('\n'):
        if l.startswith('```'):
            flush(); code=not code; out.append(l); continue
        if code: out.append(l); continue
        if not l.strip() or l.startswith(('|','#','<!--','![')):
            flush(); out.append(l); continue
        if re.match(r'^\s*(?:[*-]|\d+\.)\s+',l): flush()
        buf.append(l)
    flush()
    return '\n'.join(out)
for f in sys.argv[1:]:
    s=open(f).read(); n=reflow(s)
    # words must be the same
    assert s.split()==n.split(),f
    bad=[l for l in n.split('\n') if re.match(r'^([+=]|\d+\.) ',l) and l not in s.split('\n')]
    if bad: print(f,bad)
    open(f,'w').write(n)
