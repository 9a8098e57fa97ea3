import re
L=[l.strip() for l in open('/tmp/docs_2/cmds2.txt') if l.strip()]
L=[l.replace('--ao-distance 0.3','--ao-distance 200') for l in L]
groups={}
def dest(o,l):
    n=o[:-4]
    for g in ('lights','cameras','media','integrators'):
        if n.startswith(g+'_'): return g+'/'+n[len(g)+1:]
    if n.startswith('noise_'): return 'integrators/'+n
    if n in('cornell','textures','ball'): return n
    return 'materials/'+n
L.append('-s 256 -f ball.png docs/scenes/ball.json')
rows=[]; pairs=[]
for l in L:
    o=re.search(r'-f ([a-z_]+\.png)',l).group(1); d=dest(o,l); pairs.append((o,d))
    groups.setdefault(d.split('/')[0] if '/' in d else 'others',[]).append('pathtracer '+l.replace('-f '+o,f'-f target/pictures/{d}.png'))
open('/tmp/docs_2/pairs.txt','w').write('\n'.join(f'{o} {d}' for o,d in pairs))
T={'materials':'Materials','lights':'Lights','cameras':'Cameras','media':'Media','integrators':'Integrators and noise','others':'Others'}
out='''# Scenes of the pictures

The pictures of this guide are renders of small scenes in [the format of pathtracer](../scene-file.md), each a file to start from. This page
has the command for each, to be run in the folder of the project. All of them together take an hour or two of a processor core.

```sh
mkdir -p target/pictures/materials target/pictures/lights target/pictures/cameras target/pictures/media target/pictures/integrators
```
'''
for g in ('materials','lights','cameras','media','integrators','others'):
    out+=f'\n## {T[g]}\n\n```sh\n'+'\n'.join(groups[g])+'\n```\n'
    if g=='materials': out+='''
The set-up is the same for all: a ball of radius 0.75 and a cube on a checkerboard, a square lamp at the left, and a dim constant
environment; the lamp is behind the sheets of `diffuse_transmission` and `principled_thin`. `lock.ply` is a lock of 40 fibres for
`hair`, of which the scene has 60 copies.
'''
out+='''
## JPEG files

The pictures in `docs/images` are JPEG files, and `materials/all.jpg` is a sheet of all materials. A script makes them (it needs Pillow):

```sh
python3 docs/scenes/to_jpeg.py target/pictures docs/images
```
'''
open('/work/main/docs/scenes/README.md','w').write(out)
