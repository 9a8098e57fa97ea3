import sys
from PIL import Image
out,cols,*fs=sys.argv[1:]; cols=int(cols)
ims=[Image.open(f).convert('RGB') for f in fs]
w,h=ims[0].size
rows=(len(ims)+cols-1)//cols
s=Image.new('RGB',(w*cols,h*rows))
for i,im in enumerate(ims): s.paste(im.resize((w,h)),((i%cols)*w,(i//cols)*h))
s.save(out)
