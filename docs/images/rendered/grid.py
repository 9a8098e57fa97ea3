OUT='/work/main/docs/scenes/materials'
def grid(name,title,rows,res,integ=''):
    """rows: list of lists of material JSON text"""
    ncol=max(map(len,rows)); nrow=len(rows)
    mats=[];objs=[]
    for j,row in enumerate(rows):
        for i,m in enumerate(row):
            n=f'{j}{i}'
            mats.append(f'    "{n}": {m}')
            x=i-(ncol-1)/2; y=(nrow-1)/2-j
            objs.append(f'    {{ "type": "sphere", "radius": 0.42, "material": "{n}", "to_world": [{{ "rotate": -90, "axis": [1, 0, 0] }}, {{ "translate": [{x:g}, {y:g}, 0] }}] }}')
    text=f'''// {title}
{{
  "pathtracer": 1,
  "settings": {{ "resolution": [{res[0]}, {res[1]}], "spp": 256{integ} }},
  "cameras": [{{ "type": "orthographic", "half_width": {ncol/2:g}, "half_height": {nrow/2:g}, "to_world": {{ "translate": [0, 0, 5] }} }}],
  "textures": {{
    "checks": {{ "type": "checkerboard", "colors": [0.5, 0.25], "to_pattern": {{ "scale": 12 }} }}
  }},
  "materials": {{
    "wall": {{ "type": "diffuse", "reflectance": "checks" }},
    "lamp": {{ "type": "black", "emission": 9 }},
{(","+chr(10)).join(mats)}
  }},
  "lights": [{{ "type": "constant", "radiance": 0.25 }}],
  "objects": [
    {{ "name": "wall", "type": "rectangle", "material": "wall", "to_world": [{{ "scale": 6 }}, {{ "translate": [0, 0, -1] }}] }},
    {{ "name": "lamp", "type": "rectangle", "material": "lamp", "to_world": [{{ "scale": 2.5 }}, {{ "rotate": 180 }}, {{ "look_at": [0, 0, 0], "from": [-5, 6, 8] }}] }},
{(","+chr(10)).join(objs)}
  ]
}}
'''
    open(f'{OUT}/{name}.json','w').write(text)
G='"eta": [0.143, 0.375, 1.442], "k": [3.983, 2.386, 1.603]'
A=[0.05,0.1,0.2,0.4,0.8]
grid('roughness','Roughness alpha of 0.05, 0.1, 0.2, 0.4 and 0.8 of gold (above) and glass (below).',
 [[f'{{ "type": "conductor", {G}, "roughness": {{ "alpha": {a}, "multiple_scattering": true }} }}' for a in A],
  [f'{{ "type": "glass", "roughness": {{ "alpha": {a}, "multiple_scattering": true }} }}' for a in A]],(600,240))
V=[0,0.25,0.5,0.75,1]
def p(**k): return '{ "type": "principled", '+', '.join(f'"{a}": {v}' for a,v in k.items())+' }'
B='[0.8, 0.35, 0.12]'
grid('principled_sweep','Parameters of the principled material at 0, 0.25, 0.5, 0.75 and 1.',
 [[p(base_color=B,roughness=v) for v in V],
  [p(base_color=B,roughness=0.3,metallic=v) for v in V],
  [p(base_color=B,roughness=0.1,spec_trans=v) for v in V],
  [p(base_color='[0.25, 0.08, 0.05]',roughness=0.8,clearcoat=v,clearcoat_gloss=0.9) for v in V],
  [p(base_color='[0.1, 0.05, 0.3]',roughness=0.9,sheen=v,sheen_tint=0.5) for v in V]],(500,500))
def m(**k): return '{ "type": "metallic_roughness", '+', '.join(f'"{a}": {v}' for a,v in k.items())+' }'
grid('metallic_roughness_parts','Parts of the material of glTF.',
 [[m(base_color=B,roughness=0.4),m(base_color=B,roughness=0.4,metallic=1),m(base_color=B,roughness=0.1,transmission=1)],
  [m(base_color='[0.25, 0.02, 0.02]',roughness=0.7,clearcoat=1,clearcoat_roughness=0.05),m(base_color='[0.05, 0.04, 0.2]',roughness=1,sheen_color='[0.8, 0.6, 0.9]',sheen_roughness=0.5),
   m(base_color=0.9,roughness=0.15,metallic=1,iridescence=1,film_ior=1.8,film_thickness=450)],
  [m(base_color=0.8,roughness=0.35,metallic=1,anisotropy=0.9),m(base_color=0.03,roughness=0.3,specular_color='[1, 2.5, 5]'),
   m(base_color=0.9,roughness=1,thin='true',diffuse_transmission=1,diffuse_transmission_color='[0.3, 0.8, 0.2]')]],(360,360))
