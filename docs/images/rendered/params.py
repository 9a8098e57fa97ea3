import re,json,glob
s=json.load(open('scene.schema.json'))['$defs']
def walk(x,out):
    for k in('anyOf','oneOf'):
        for a in x.get(k,[]): walk(a,out)
    if 'properties' in x:
        t=x['properties'].get('type',{}).get('const')
        if t: out.setdefault(t,{}).update(x['properties'])
defs={}
for d in ('Surface','Light','Medium','Texture','Camera'):
    o={}; walk(s[d],o); defs[d]=o
page={'lights.md':'Light','cameras.md':'Camera','media.md':'Medium','textures.md':'Texture'}
common={'Surface':set(),'Light':{'name','to_world'},'Medium':{'name'},'Texture':{'layout','to_pattern'},'Camera':{'name','to_world','near','far','lens_radius','aperture','focal_distance','principal_point_offset','fit','medium','shutter','motion','placement','meter'}}
seen={d:set() for d in defs}
for f in list(page)+sorted(glob.glob('materials/*.md')):
    d=page.get(f,'Surface'); t=open(f).read()
    for n,body in re.findall(r'<!-- parameters: (\w+) -->\n(.*?)<!-- end -->',t,re.S):
        if n not in defs[d]: print(f,'unknown',n); continue
        seen[d].add(n)
        keys=set(); rows={}
        for l in body.split('\n')[2:]:
            c=[x.strip() for x in l.strip('|').split(' | ')]
            ks=re.findall(r'`(\w+)`',c[0]) if c[0] else []
            for k in ks: keys.add(k); rows[k]=c
        want=set(defs[d][n])-{'type'}-common[d]
        if keys!=want: print(f,n,'missing',want-keys,'extra',keys-want)
        for k in keys&want:
            dv=defs[d][n][k].get('default'); 
            if dv is not None and k in rows:
                col=rows[k][2]
                if str(dv).lower() not in col.lower() : print(f,n,k,'default',dv,'table',col)
for d in defs: print(d,set(defs[d])-seen[d])
