// assay:version 0.1 (commit 70b628236a6d)
// assay:command assay export --engine povray -r 480 360 -m 5 -b 0 -d 4.7 'it'\''s a'$'\012''line.dae'
// assay:scene 18fd532b9b8d439504e81571bd0d5e6ca71abc418539d438fa310b3f43c3f886
// Render linear: povray +Iscene.pov +Oscene.exr +FE +W480 +H360 -A -D -P +WT1 File_Gamma=1.0
// Numbers are radiance times S, right-handed, Y up.
#version 3.7;
#declare S = 1;
global_settings { assumed_gamma 1.0 max_trace_level 60 adc_bailout 1e-09 }
#default { finish { ambient 0 } }
camera { location <0.25,2,-0.125>
  direction <0,-1,-6.12323426e-17>
  right <1,0,0>
  up <0,4.5924257e-17,-0.75> }

// plane
mesh2 {
  vertex_vectors { 6,
    <-4,0,4>,<4,0,4>,<4,0,-4>,
    <-4,0,4>,<4,0,-4>,<-4,0,-4> }
  face_indices { 2,
    <0,1,2>,<3,4,5> }
  texture { pigment { rgb <0.5,0.600000024,0.699999988> } finish { diffuse 1 } }
}

// point light
light_source { <0.85000002