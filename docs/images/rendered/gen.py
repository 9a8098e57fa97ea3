#!/usr/bin/env python3
"""Writes the scenes of the material pictures."""
import os
OUT='/work/main/docs/scenes/materials'
os.makedirs(OUT,exist_ok=True)
HEAD='''// {title}
{{
  "pathtracer": 1,
  "settings": {{ "resolution": [320, 320], "spp": 256{settings} }},
  "cameras": [
    {{ "type": "perspective", "y_fov": 24, "to_world": {{ "look_at": [0.1, 0.6, 0], "from": [0, 2.3, 5.6] }} }}
  ],
  "textures": {{
    "checks": {{ "type": "checkerboard", "colors": [0.5, 0.25], "to_pattern": {{ "scale": 14 }} }}{textures}
  }},{tables}
  "materials": {{
    "ground": {{ "type": "diffuse", "reflectance": "checks" }},
    "lamp": {{ "type": "black", "emission": {lamp} }},
{materials}
  }},
  "lights": [{{ "type": "constant", "radiance": {env} }}],
  "objects": [
    {{ "name": "ground", "type": "rectangle", "material": "ground", "to_world": [{{ "rotate": -90, "axis": [1, 0, 0] }}, {{ "rotate": 20 }}, {{ "scale": 7 }}] }},
    {{ "name": "lamp", "type": "rectangle", "material": "lamp", "to_world": [{{ "scale": {lampsize} }}, {{ "rotate": 180 }}, {{ "look_at": [0, 0.5, 0], "from": {lampfrom} }}, {{ "comment": 0 }}] }},
{objects}
  ]
}}
'''
HEAD=HEAD.replace(', {{ "comment": 0 }}','')
BALL='''    { "name": "ball", "type": "sphere", "radius": 0.75, "material": "%s", "to_world": [{ "rotate": -90, "axis": [1, 0, 0] }, { "translate": [-0.2, 0.75, -0.1] }] },
    { "name": "cube", "type": "cube", "material": "%s", "to_world": [{ "scale": 0.28 }, { "rotate": 32 }, { "translate": [0.74, 0.28, 0.6] }] }'''
def scene(name,title,materials,objects=None,textures='',tables='',ball=None,cube=None,env="0.2",lamp='5',lampfrom='[-2.6, 4.2, 2.6]',settings='',lampsize='1.5'):
    b=ball or name; c=cube or b
    text=HEAD.format(title=title,textures=textures,tables=tables,materials='    '+materials.replace('\n','\n    '),objects=objects or BALL%(b,c),env=env,lamp=lamp,lampfrom=lampfrom,settings=settings,lampsize=lampsize)
    open(f'{OUT}/{name}.json','w').write(text)
exec(open('/tmp/docs_2/list.py').read())
