import subprocess,os,shutil,re,sys
R='/work/main'; W='/tmp/docs_2/cmdtest'; shutil.rmtree(W,ignore_errors=True); os.makedirs(W+'/scenes')
src=open(R+'/crates/pt-cli/tests/common/mod.rs').read() if os.path.exists(R+'/crates/pt-cli/tests/common/mod.rs') else ''
m=re.search(r'SCENE: &str = concat!\(env!\("CARGO_MANIFEST_DIR"\), "(.*?)"',open(subprocess.run(['grep','-rl','SCENE: &str',R+'/crates/pt-cli/tests'],capture_output=True,text=True).stdout.split()[0]).read())
scene=R+'/scenes/cornell.dae'; print(m and m.group(1))
shutil.copy(scene,W+'/scene.dae'); shutil.copy(scene,W+'/CBbunny.dae'); shutil.copy(R+'/scenes/motion.xml',W+'/scenes/')
open(W+'/bunny.ply','w').write("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
shutil.copy(R+'/scenes/json/parts/sky.exr',W)
pages=sys.argv[1:]
import json
shutil.copy('/tmp/docs_2/t/ball.json',W+'/ball.json')
j=json.load(open(W+'/ball.json')); j['cameras'][0]['name']='main'; json.dump(j,open(W+'/scene.json','w'))
open(W+'/scene.xml','w').write('<scene version="3.0.0"><sensor type="perspective"/><shape type="sphere"/><emitter type="constant"/></scene>')
subprocess.run('/tmp/bin/pathtracer convert -q scene.json scene.glb',shell=True,cwd=W)
subprocess.run('/tmp/bin/pathtracer -q -s 2 -r 12 9 -f long.exr',shell=True,cwd=W)
os.makedirs(W+'/old')

cmds=[]
for p in pages:
    sh=False
    for l in open(p).read().split('\n'):
        if l=='```sh': sh=True
        elif l=='```': sh=False
        elif sh and l.startswith('pathtracer '): cmds.append((p,l[11:].split('#')[0].strip()))
        elif sh and l.strip()=='pathtracer': cmds.append((p,''))
def reduced(c):
    if c.startswith('convert'): return c.replace('convert','convert --force',1)
    if any(c.startswith(n) for n in ['resume','info','check','convert','merge','rerender']): return c
    size=['200','150'] if '-p ' in c or '-x ' in c else ['12','9']
    w=c.split()
    if '--target-' in c: w+=['--max-spp','4']
    elif '-s' not in w and '--samples' not in w: w+=['-s','2']
    if '-r' not in w: w+=['-r','12','9']
    for i in range(1,len(w)):
        if w[i-1]=='-s' : w[i]='2'
        elif w[i-1]=='-r': w[i],w[i+1]=size
    return ' '.join(w)
for p,c in cmds:
    r=subprocess.run('/tmp/bin/pathtracer '+reduced(c),shell=True,cwd=W,capture_output=True,text=True)
    ok=r.returncode==0
    if not ok: print('FAIL',p,reduced(c),r.returncode,r.stderr.strip()[:300])
print(len(cmds),'commands')
