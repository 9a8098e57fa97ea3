import re,glob,subprocess,json,os
D='/work/main/docs/'
BASE='''{ "pathtracer": 1, "cameras": [%(cam)s],
 "textures": { "leaf": { "type": "dots", "colors": [1, 0] }, "wrinkles": { "type": "wrinkled" }, "checks": { "type": "checkerboard", "colors": [1, 0] }%(tex)s },
 "grids": { "density": { "resolution": [1,1,1], "values": [1] }, "heat": { "resolution": [1,1,1], "values": [1000] }%(grid)s },
 "media": { "fog": { "type": "homogeneous", "extinction": 1 }%(med)s },
 "materials": { "boundary": "black", "lamp": "black", "red": "black", "m0": %(mat)s },
 "lights": [%(light)s], "objects": [{ "type": "sphere", "material": "m0" }%(obj)s] }'''
DEF=dict(cam='{ "type": "perspective", "y_fov": 30, "to_world": { "translate": [0,0,5] } }',tex='',grid='',med='',mat='"diffuse"',light='{ "type": "constant", "radiance": 1 }',obj='')
n=0
for f in sorted(glob.glob(D+'materials/*.md')+[D+x for x in('lights.md','cameras.md','media.md','textures.md','first-picture.md')]):
    for s in re.findall(r'```json\n(.*?)```',open(f).read(),re.S):
        s=s.strip(); d=dict(DEF); name=os.path.relpath(f,D)
        if '"pathtracer"' in s: text=s
        elif s.startswith('{'):
            if '"alpha"' in s and '"type"' not in s: d['mat']='{ "type": "conductor", "eta": 1, "k": 1, "roughness": %s }'%s
            elif name=='lights.md': d['light']=s.replace('…','"x"')
            elif name=='cameras.md': d['cam']=s
            elif name=='media.md': d['med']=', "m": '+s
            elif name=='textures.md': d['tex']=', "t": '+s
            else: d['mat']=s.replace('…','')
            text=BASE%d
        else:
            frag='{'+s+'}'
            try: j=json.loads(frag)
            except Exception as e: print(name,'NOT JSON',s[:80],e); continue
            if all(isinstance(v,dict) and 'type' in v for v in j.values()) and name=='media.md' and 'settings' not in j:
                d['med']=', '+s; text=BASE%d
            else:
                base=json.loads(BASE%d)
                for k,v in j.items():
                    if isinstance(v,dict) and isinstance(base.get(k),dict): base[k].update(v)
                    elif isinstance(v,list) and k=='objects': base[k]+=v
                    else: base[k]=v
                text=json.dumps(base)
        open('s.json','w').write(text)
        r=subprocess.run(['/tmp/bin/pathtracer','check','s.json'],capture_output=True,text=True); n+=1
        if r.returncode not in(0,1): print(name,'FAIL',s[:90],'\n   ',(r.stdout+r.stderr)[:300])
print(n,'snippets')
