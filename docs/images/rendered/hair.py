"""Writes lock.ply, 40 fibres over a rod, and the scene of hair."""
import numpy as np, struct
rng=np.random.default_rng(1)
P=[];N=[];UV=[];T=[]
S,R=3,9
for f in range(40):
    x0=rng.uniform(-.03,.03); dx=rng.normal(0,.02); r0=.58+rng.uniform(0,.03); w=rng.normal(0,.01); ph=rng.uniform(0,6.28)
    a=np.radians(np.linspace(-115,115,R)+rng.normal(0,3))
    t=np.linspace(0,1,R)
    x=x0+dx*(t-.5)*2+.012*np.sin(5*t+ph)
    rr=r0+w*np.sin(4*t+ph)*.6
    c=np.stack([x,rr*np.cos(a),rr*np.sin(a)],1)
    tang=np.gradient(c,axis=0); tang/=np.linalg.norm(tang,axis=1)[:,None]
    out=np.stack([0*x,np.cos(a),np.sin(a)],1); out-=tang*(out*tang).sum(1)[:,None]; out/=np.linalg.norm(out,axis=1)[:,None]
    side=np.cross(tang,out)
    base=len(P)
    for i in range(R):
        rad=.0042*(1 if i<R-1 else .5)
        for k in range(S):
            th=2*np.pi*k/S+.3
            n=out[i]*np.cos(th)+side[i]*np.sin(th)
            P.append(c[i]+n*rad);N.append(n);UV.append((t[i],k/S))
    for i in range(R-1):
        for k in range(S):
            a0=base+i*S+k;b0=base+i*S+(k+1)%S;a1=a0+S;b1=b0+S
            T+= [(a0,b0,b1),(a0,b1,a1)]
P=np.array(P);N=np.array(N)
# front outside?
t=T[0]; n=np.cross(P[t[1]]-P[t[0]],P[t[2]]-P[t[0]]); print('outward' if n@N[t[0]]>0 else 'inward')
if n@N[t[0]]<0: T=[(a,c,b) for a,b,c in T]
V=np.concatenate([P,N,np.array(UV)],1).astype('<f4')
with open('/work/main/docs/scenes/materials/lock.ply','wb') as f:
    f.write(f"ply\nformat binary_little_endian 1.0\nelement vertex {len(V)}\n".encode()+b''.join(f'property float {k}\n'.encode() for k in 'x y z nx ny nz u v'.split())+f"element face {len(T)}\nproperty list uchar ushort vertex_indices\nend_header\n".encode())
    f.write(V.tobytes())
    for t in T: f.write(struct.pack('<BHHH',3,*t))
print(len(V),len(T))
objs=[]
n=60
for i in range(n):
    x=-.78+1.5*(i+.5)/n
    objs.append('    { "type": "mesh", "mesh": "lock", "material": "hair", "to_world": [{ "rotate": %.1f }, { "rotate": %.1f, "axis": [1, 0, 0] }, { "translate": [%.3f, 0.56, -0.1] }] }'%(rng.normal(0,2.5),rng.normal(4,6),x))
objs.insert(0,'    { "name": "rod", "type": "cylinder", "material": "rod", "to_world": [{ "rotate": 90 }, { "scale": [1.6, 0.55, 0.55] }, { "translate": [-0.85, 0.56, -0.1] }] }')
exec(open('gen.py').read().split('exec(')[0])
scene('hair','Reddish blond hair over a rod: 60 copies of a lock of 40 fibres.','''"hair": { "type": "hair", "eumelanin": 0.2, "pheomelanin": 0.3 },
"rod": { "type": "diffuse", "reflectance": [0.12, 0.06, 0.03] }''',objects=',\n'.join(objs),lamp='28',lampsize='1',lampfrom='[-1.6, 4, 3.4]',tables='''
  "meshes": { "lock": { "file": "lock.ply" } },''')
