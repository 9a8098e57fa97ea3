GOLD='"eta": [0.143, 0.375, 1.442], "k": [3.983, 2.386, 1.603]'
COPPER='"eta": [0.201, 0.924, 1.102], "k": [3.913, 2.453, 2.142]'
RED='[0.7, 0.12, 0.08]'; BLUE='[0.1, 0.22, 0.6]'
scene('diffuse','Lambertian reflection.','"diffuse": { "type": "diffuse", "reflectance": [0.7, 0.32, 0.2] }')
scene('rough_diffuse','Rough diffuse reflection: flatter than Lambert, as clay and plaster.','"rough_diffuse": { "type": "rough_diffuse", "reflectance": [0.7, 0.32, 0.2], "roughness": 1 }')
scene('mirror','A perfect mirror.','"mirror": { "type": "mirror", "reflectance": 0.95 }')
scene('glass','Smooth glass, and a cube of rough glass.','''"glass": { "type": "glass", "ior": 1.5 },
"frosted": { "type": "glass", "ior": 1.5, "roughness": { "alpha": 0.25, "multiple_scattering": true } }''',cube='frosted')
scene('refraction','An interface that refracts and does not reflect.','"refraction": { "type": "refraction", "ior": 1.5 }')
PANE='''    { "name": "ball", "type": "sphere", "radius": 0.6, "material": "ball", "to_world": { "translate": [-0.15, 0.6, -0.6] } },
    { "name": "cube", "type": "cube", "material": "ball", "to_world": [{ "scale": 0.28 }, { "rotate": 32 }, { "translate": [0.95, 0.28, -0.2] }] },
    { "name": "pane", "type": "rectangle", "material": "%s", "to_world": [{ "scale": [0.8, 0.62, 1] }, { "rotate": %s, "axis": [1, 0, 0] }, { "rotate": %s }, { "translate": [0.25, 0.6, 0.6] }] }'''
scene('thin_glass','A thin pane before a ball and a cube.','''"thin_glass": { "type": "thin_glass", "ior": 1.5, "transmittance": [0.75, 0.9, 0.8] },
"ball": { "type": "diffuse", "reflectance": %s }'''%RED,objects=PANE%('thin_glass','-22','-18'),settings=', "integrator": "volpath", "straight_is_free": true')
scene('conductor','Gold: a rough ball and a smooth cube.',f'''"conductor": {{ "type": "conductor", {GOLD}, "roughness": {{ "alpha": 0.2 }} }},
"smooth": {{ "type": "conductor", {GOLD} }}''',cube='smooth')
scene('coated_diffuse','A diffuse base under a smooth coat.',f'"coated_diffuse": {{ "type": "coated_diffuse", "diffuse": {RED}, "nonlinear": true }}')
scene('rough_coated_diffuse','A diffuse base under a rough coat.',f'"rough_coated_diffuse": {{ "type": "rough_coated_diffuse", "diffuse": {RED}, "alpha": 0.2, "nonlinear": true }}')
scene('fresnel_plastic','A diffuse base below facets that light crosses once on each way.',f'"fresnel_plastic": {{ "type": "fresnel_plastic", "diffuse": {RED}, "roughness": {{ "alpha": 0.1 }} }}')
scene('plastic','A diffuse base with a glossy reflection.',f'"plastic": {{ "type": "plastic", "diffuse": {RED}, "specular": 0.04, "alpha": 0.1 }}')
scene('coated_conductor','Brushed copper under a clear, smooth varnish.',f'"coated_conductor": {{ "type": "coated_conductor", {COPPER}, "alpha": 0.35, "coat_alpha": 0.01 }}')
scene('principled','Car paint: a metallic base under a clear coat.','"principled": { "type": "principled", "base_color": [0.06, 0.14, 0.5], "metallic": 0.6, "roughness": 0.45, "clearcoat": 1, "clearcoat_gloss": 1 }')
scene('metallic_roughness','A metal under a thin film with interference colours.','"metallic_roughness": { "type": "metallic_roughness", "base_color": [0.8, 0.8, 0.85], "metallic": 1, "roughness": 0.35, "iridescence": 1, "film_ior": 1.8, "film_thickness": 480 }')
scene('measured','A measured anisotropic material.','"measured": { "type": "measured", "measurements": { "file": "../../../scenes/mitsuba/brushed.bsdf" } }')
scene('black','A black ball, and a cube that emits light.','''"black": { "type": "black" },
"light": { "type": "black", "emission": [1.4, 0.6, 0.12] }''',cube='light')
scene('opacity','Opacity by a texture, and constant opacity.','''"opacity": { "type": "diffuse", "reflectance": [0.2, 0.45, 0.25], "opacity": "net" },
"faint": { "type": "diffuse", "reflectance": [0.2, 0.45, 0.25], "opacity": 0.4 }''',textures=''',
    "net": { "type": "checkerboard", "colors": [1, 0], "to_pattern": { "scale": [16, 8] } }''',cube='faint')
scene('mix','Gold leaf on blue lacquer, mixed by a texture.',f'''"mix": {{
  "type": "mix", "amount": "leaf",
  "first": {{ "type": "plastic", "diffuse": {BLUE} }},
  "second": {{ "type": "conductor", {GOLD}, "roughness": {{ "alpha": 0.15 }} }}
}}''',textures=''',
    "leaf": { "type": "dots", "colors": [1, 0], "layout": "space", "to_pattern": { "scale": 5 } }''')
scene('surface_detail','A bump map of noise on plastic.',f'''"surface_detail": {{
  "type": "surface_detail", "height_map": "wrinkles", "height": 0.04,
  "surface": {{ "type": "plastic", "diffuse": [0.55, 0.42, 0.2], "alpha": 0.15 }}
}}''',textures=''',
    "wrinkles": { "type": "wrinkled", "octaves": 4, "layout": { "type": "space", "to_texture": { "scale": 4 } } }''')

scene('diffuse_transmission','A leaf-green sheet lit from behind: the ball behind it casts its shadow onto it.',f'''"diffuse_transmission": {{ "type": "diffuse_transmission", "reflectance": [0.12, 0.3, 0.05], "transmittance": [0.2, 0.5, 0.06] }},
"ball": {{ "type": "diffuse", "reflectance": {RED} }}''',objects=(PANE%('diffuse_transmission','-13','-24')).replace('[-0.15, 0.6, -0.6]','[-0.15, 0.6, -0.3]'),lampfrom='[-2.2, 3.6, -3.4]',lamp='40',lampsize='0.6')
scene('principled_thin','A frosted pane lit from behind.',f'''"principled_thin": {{
  "type": "principled_thin", "base_color": [0.95, 0.8, 0.55], "roughness": 0.35, "spec_trans": 0.7, "diff_trans": 1.2
}},
"ball": {{ "type": "diffuse", "reflectance": {RED} }}''',objects=PANE%('principled_thin','-13','-24'),lampfrom='[-2.2, 3.6, -3.4]',lamp='7')
scene('two_sided','A tube that is red outside and blue inside.',f'''"two_sided": {{
  "type": "two_sided",
  "front": {{ "type": "plastic", "diffuse": {RED} }},
  "back": {{ "type": "diffuse", "reflectance": {BLUE} }}
}}''',objects='''    { "name": "tube", "type": "cylinder", "material": "two_sided", "to_world": [{ "rotate": -90, "axis": [1, 0, 0] }, { "scale": [0.75, 1, 0.75] }, { "rotate": 24, "axis": [1, 0, 0] }, { "translate": [0.05, 0.25, -0.35] }] }''')
