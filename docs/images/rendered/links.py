import re,os,glob
R='/work/main'
def slug(h):
    h=re.sub(r'\[([^\]]*)\]\([^)]*\)',r'\1',h); h=h.replace('`','').strip().lower()
    return ''.join('-' if c==' ' else c for c in h if c.isalnum() or c in ' -_')
def parse(p):
    t=open(p).read(); anchors=set(); links=[]
    out=[];code=False
    for l in t.split('\n'):
        if l.lstrip().startswith('```'): code=not code; continue
        if code: continue
        m=re.match(r'^(#+)\s+(.*)',l)
        if m:
            a=slug(m.group(2)); b=a;n=1
            while b in anchors: b=f'{a}-{n}'; n+=1
            anchors.add(b)
        out.append(l)
    body=re.sub(r'`[^`]*`','',' '.join(out))
    links=re.findall(r'\]\(([^)\s]+)\)',body)
    return anchors,links
files=glob.glob(R+'/docs/**/*.md',recursive=True)+[R+'/README.md',R+'/ARCHITECTURE.md',R+'/CONTRIBUTING.md',R+'/CHANGELOG.md',R+'/crates/pt-bvh/README.md']
P={f:parse(f) for f in files}
bad=0
for f,(a,ls) in P.items():
    for l in ls:
        if '://' in l or l.startswith('mailto'): continue
        x,_,frag=l.partition('#')
        t=os.path.normpath(os.path.join(os.path.dirname(f),x)) if x else f
        if not os.path.exists(t): print('MISSING',f[len(R)+1:],l); bad+=1
        elif frag and t in P and frag not in P[t][0]: print('ANCHOR',f[len(R)+1:],l); bad+=1
print(len(P),'pages',sum(len(l) for _,l in P.values()),'links',bad,'bad')
