import re,subprocess
t=subprocess.run(['/tmp/bin/pathtracer','--help'],capture_output=True,text=True).stdout
lines=t.split('\n')
head=None; out=[]; cur=None
for l in lines:
    m=re.match(r'^([A-Z][A-Za-z ]+):$',l)
    if m: head=m.group(1); cur=None; continue
    if head in (None,'Arguments','Commands') : continue
    m=re.match(r'^ {2,6}(-\S.*)$',l)
    if m and not l.startswith('          '):
        cur={'head':head,'opt':m.group(1).strip(),'text':[]}; out.append(cur); continue
    if cur is not None: cur['text'].append(l.strip())
res=[]
last=None
for o in out:
    txt=o['text']; para=' '.join(x for x in txt if x and not x.startswith('- ') and x!='Possible values:')
    # possible values with continuation
    vals=[]; inv=False
    body=[]
    for x in txt:
        if x=='Possible values:': inv=True; continue
        if inv:
            if x.startswith('- '): vals.append(x[2:]); continue
            if x.startswith('['): inv=False; body.append(x); continue
            if not x: inv=False; continue
            vals[-1]+=' '+x; continue
        if x: body.append(x)
    body=' '.join(body)
    d=re.search(r'\[default: (.*?)\](?: |$)',body+' '); a=re.search(r'\[alias: (.*?)\]',body); p=re.search(r'\[possible values: (.*?)\]',body)
    for m in (d,a,p):
        if m: body=body.replace(m.group(0).strip(),'')
    body=re.sub(r'\s+',' ',body).strip()
    if p: body+=': '+', '.join(f'`{v.strip()}`' for v in p.group(1).split(','))
    if vals:
        vs=[]
        for v in vals:
            n,_,x=v.partition(':'); vs.append(f'`{n.strip()}` ({x.strip()})' if x else f'`{n}`')
        body+=': '+'; '.join(vs)
    if o['head']!=last:
        res.append(f"\n### {'General' if o['head']=='Options' else o['head']}\n\n| option | default | meaning |\n|---|---|---|"); last=o['head']
    body=re.sub(r'(?<![`\w-])(--?[a-z][a-z0-9-]*)',r'`\1`',body)
    body=body.replace('|','\\|'); 
    opt=o['opt'].replace('|','\\|')
    res.append(f"| `{opt}` | {(d.group(1) if d else '').replace('|','')} | {body} |")
open('/tmp/docs_2/opts.md','w').write('\n'.join(res).strip()+'\n')
