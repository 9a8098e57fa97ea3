import os
OUT='/work/main/docs/scenes'
def ball(x,y,n,r=0.42): return f'    {{ "type": "sphere", "radius": {r}, "material": "{n}", "to_world": [{{ "rotate": -90, "axis": [1, 0, 0] }}, {{ "rotate": -60 }}, {{ "translate": [{x:g}, {y:g}, 0] }}] }}'
T=[('bitmap','{ "type": "bitmap", "image": { "file": "../../scenes/mitsuba/parts/clouds.png" } }'),
('checkerboard','{ "type": "checkerboard", "colors": [[0.8, 0.75, 0.6], [0.1, 0.2, 0.4]], "to_pattern": { "scale": [8, 4] } }'),
('checkerboard3d','{ "type": "checkerboard3d", "colors": [[0.8, 0.75, 0.6], [0.1, 0.2, 0.4]], "layout": { "type": "space", "to_texture": { "scale": 3 } } }'),
('dots','{ "type": "dots", "colors": [[0.8, 0.15, 0.1], [0.75, 0.7, 0.6]], "layout": "space", "to_pattern": { "scale": 7 } }'),
('fbm','{ "type": "blend", "first": [0.05, 0.15, 0.35], "second": [0.9, 0.9, 0.85], "amount": { "type": "fbm", "layout": { "type": "space", "to_texture": { "scale": 4 } } } }'),
('wrinkled','{ "type": "product", "factors": [[1.6, 1, 0.6], { "type": "wrinkled", "layout": { "type": "space", "to_texture": { "scale": 4 } } }] }'),
('windy','{ "type": "blend", "first": [0.5, 0.4, 0.2], "second": [0.9, 0.85, 0.6], "amount": { "type": "product", "factors": [6, { "type": "windy", "layout": { "type": "space", "to_texture": { "scale": 20 } } }] } }'),
('marble','{ "type": "marble", "variation": 4, "layout": { "type": "space", "to_texture": { "scale": 6 } } }'),
('grid','{ "type": "grid", "grid": "cells", "layout": { "type": "space", "to_texture": [{ "translate": [1.5, 1.5, 0.5] }] } }'),
('abs_normal_dot','{ "type": "blend", "first": [0.35, 0.25, 0.15], "second": [0.9, 0.9, 0.95], "amount": { "type": "abs_normal_dot", "direction": [0, 1, 0] } }'),
('blend','{ "type": "blend", "first": [0.1, 0.3, 0.1], "second": [0.8, 0.6, 0.2], "amount": { "type": "checkerboard", "colors": [1, 0], "to_pattern": { "scale": [1, 8] } } }'),
('product','{ "type": "product", "factors": [{ "type": "checkerboard", "colors": [1, 0.4], "to_pattern": { "scale": [12, 6] } }, { "type": "checkerboard", "colors": [[0.9, 0.3, 0.2], [0.2, 0.4, 0.8]], "to_pattern": { "scale": [1, 1] } }] }')]
import random
random.seed(3)
cells=', '.join(f'{random.choice([0.08,0.8]):g}, {random.choice([0.2,0.7]):g}, {random.choice([0.1,0.6]):g}' for _ in range(64))
mats=[];objs=[]
for k,(n,t) in enumerate(T):
    i,j=k%4,k//4
    mats.append(f'    "{n}": {{ "type": "diffuse", "reflectance": {t} }}')
    objs.append(ball(i-1.5,1-j,n))
open(f'{OUT}/textures.json','w').write(f'''// Textures, row by row: bitmap, checkerboard, checkerboard3d, dots; fbm, wrinkled, windy, marble; grid, abs_normal_dot, blend, product.
{{
  "pathtracer": 1,
  "settings": {{ "resolution": [480, 360], "spp": 256 }},
  "cameras": [{{ "type": "orthographic", "half_width": 2, "half_height": 1.5, "to_world": {{ "translate": [0, 0, 5] }} }}],
  "grids": {{ "cells": {{ "resolution": [4, 4, 4], "channels": 3, "values": [{cells}] }} }},
  "materials": {{
    "wall": {{ "type": "diffuse", "reflectance": 0.3 }},
    "lamp": {{ "type": "black", "emission": 11 }},
{(","+chr(10)).join(mats)}
  }},
  "lights": [{{ "type": "constant", "radiance": 0.3 }}],
  "objects": [
    {{ "name": "wall", "type": "rectangle", "material": "wall", "to_world": [{{ "scale": 6 }}, {{ "translate": [0, 0, -1] }}] }},
    {{ "name": "lamp", "type": "rectangle", "material": "lamp", "to_world": [{{ "scale": 2.5 }}, {{ "rotate": 180 }}, {{ "look_at": [0, 0, 0], "from": [-5, 6, 8] }}] }},
{(","+chr(10)).join(objs)}
  ]
}}
''')
