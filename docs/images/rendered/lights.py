import os
OUT='/work/main/docs/scenes/lights'; os.makedirs(OUT,exist_ok=True)
def L(name,title,light,lamp='',extra='',fov=34,settings='',wall='4'):
    if name in 'environment daylight': wall='2.2'
    if 'spot' in name or name in 'projector ies': light+=', { "type": "constant", "radiance": 0.04 }'
    ls=f'  "lights": [{light}],\n' if light else ''
    open(f'{OUT}/{name}.json','w').write(f'''// {title}
{{
  "pathtracer": 1,
  "settings": {{ "resolution": [320, 240], "spp": 256{settings} }},
  "cameras": [{{ "type": "perspective", "y_fov": {fov}, "to_world": {{ "look_at": [0, 0.72, 0], "from": [0, 1.7, 5.2] }} }}],
  "materials": {{
    "stage": {{ "type": "diffuse", "reflectance": 0.6 }},
    "red": {{ "type": "diffuse", "reflectance": [0.65, 0.15, 0.1] }},
    "blue": {{ "type": "plastic", "diffuse": [0.1, 0.2, 0.6] }}{lamp}
  }},
{ls}  "objects": [
    {{ "name": "floor", "type": "rectangle", "material": "stage", "to_world": [{{ "rotate": -90, "axis": [1, 0, 0] }}, {{ "scale": 6 }}] }},
    {{ "name": "wall", "type": "rectangle", "material": "stage", "to_world": [{{ "scale": [6, {wall}, 1] }}, {{ "translate": [0, 0, -1.4] }}] }},
    {{ "name": "ball", "type": "sphere", "radius": 0.5, "material": "blue", "to_world": {{ "translate": [-0.6, 0.5, 0] }} }},
    {{ "name": "cube", "type": "cube", "material": "red", "to_world": [{{ "scale": 0.4 }}, {{ "rotate": 30 }}, {{ "translate": [0.7, 0.4, 0.1] }}] }}{extra}
  ]
}}
''')
FROM='"to_world": { "look_at": [0, 0.6, -0.5], "from": [1.2, 2.6, 2] }'
SUN='"to_world": { "look_at": [0, 0, 0], "from": [2, 3, 2.5] }'
L('constant','Constant light from all directions.','{ "type": "constant", "radiance": 0.9 }')
L('hemisphere','Constant light from above.','{ "type": "hemisphere", "radiance": 0.9 }')
L('environment','An environment map.','{ "type": "environment", "image": { "file": "../../../scenes/json/parts/sky.exr" } }')
L('daylight','The sun and a clear sky.','{ "type": "daylight", "to_sun": [1, 0.7, 0.8], "turbidity": 3, "sky": 2, "sun": 2 }')
L('directional','Parallel light.',f'{{ "type": "directional", "irradiance": 4, {SUN} }}')
L('distant_disk','A large sun.','{ "type": "distant_disk", "irradiance": 4, "angular_radius": 6, "to_world": { "look_at": [0, 0, 0], "from": [2, 3, 2.5] } }')
L('point','A point light.',f'{{ "type": "point", "intensity": 22, "to_world": {{ "translate": [1.2, 2.6, 2] }} }}')
L('spot','A spotlight with a falloff by a power of the cosine.',f'{{ "type": "spot", "intensity": 45, "falloff_angle": 40, "falloff_exponent": 20, {FROM} }}')
L('linear_spot','A spotlight that falls off linearly in the angle.',f'{{ "type": "linear_spot", "intensity": 40, "beam_angle": 8, "cutoff_angle": 20, {FROM} }}')
L('punctual_spot','A spotlight of glTF.',f'{{ "type": "punctual_spot", "intensity": 40, "inner_angle": 8, "outer_angle": 20, {FROM} }}')
L('projector','A projected picture.',f'{{ "type": "projector", "intensity": 40, "x_fov": 48, "y_fov": 36, "texture": {{ "type": "checkerboard", "colors": [[1, 0.8, 0.3], [0.2, 0.5, 1]], "to_pattern": {{ "scale": [4, 3] }} }}, {FROM} }}')
L('ies','A luminaire by its photometric file.','{ "type": "ies", "profile": { "file": "../../../scenes/mitsuba/parts/downlight.ies" }, "scale": 0.06, "to_world": [{ "rotate": -90, "axis": [1, 0, 0] }, { "translate": [0, 2.1, -0.6] }] }')
L('area','A square light.','{ "type": "area", "radiance": 20, "to_world": [{ "scale": 1.2 }, { "look_at": [0, 0.6, -0.5], "from": [1.2, 2.6, 2] }] }')
L('emission','Surfaces that emit light.','',lamp=''',
    "lamp": { "type": "black", "emission": [7, 4.5, 2] }''',extra=''',
    { "name": "lamp", "type": "sphere", "radius": 0.2, "material": "lamp", "to_world": { "translate": [0.1, 1.5, -0.4] } },
    { "name": "tube", "type": "cylinder", "material": "lamp", "to_world": [{ "rotate": 90 }, { "scale": [2.8, 0.05, 0.05] }, { "translate": [-1.4, 0.06, 0.9] }] }''')
