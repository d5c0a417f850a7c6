# Studies: what is measured at length, by hand, and stored or quoted.

$(BUILD)/deps-slurm: | $(BUILD)/deps
	$(call install_missing,slurm-wlm munge)
#: make slurm      jobs on a Slurm cluster of four nodes on this machine, one killed (as root; a minute)
slurm: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/deps-slurm
	tests/studies/scale/slurm.sh $(BUILD)
$(BUILD)/deps-distros: | $(BUILD)/deps
	$(call install_missing,mmdebstrap)
#: make distros    all of it in new minimal roots of Debian 12 and 13 (as root, with mmdebstrap: an hour and a half; SUITES=trixie STEPS="build live")
distros: $(BUILD)/deps-distros
	SUITES="$(SUITES)" tests/studies/distros/distros.sh $(BUILD)/distros $(STEPS)
#: make scale-live live references and validations in jobs, with Blender and POV-Ray (minutes)
scale-live: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/deps-live
	tests/studies/scale/scale_live.sh $(BUILD)
#: make large      an image of 16384 x 16384 in jobs, within 2 GiB (30 GB of disk; SIDE=16384)
large: $(BUILD)/pathtracer $(BUILD)/assay $(BUILD)/deps-test
	tests/studies/scale/large.sh $(BUILD) $(or $(SIDE),16384)
#: make scale      simulate a class, a suite and a large image on up to 1000 nodes (tools/docs/background/scale.md)
scale: $(BUILD)/tests/make_scale
	$<
#: make pairs      scenes 5x and 6x: each level switched off, other ways to the same images, and the page of both
pairs: all
	nice python3 reference/pairs/knockout.py $(BUILD) -o reference/pairs/knockout.json
	nice python3 reference/pairs/runs.py $(BUILD) -o reference/pairs/runs.json
	python3 reference/pairs/pairs_page.py
#: make collada-cts  every file of Khronos' COLLADA conformance suite (COLLADA_CTS=DIR: a copy of it) through build/pathtracer
collada-cts: all
	tests/studies/collada_cts/collada_cts.py $(BUILD)/pathtracer $(COLLADA_CTS)
#: make blender-scenes  scenes made in Blender, through its COLLADA exporter, against Cycles (needs Blender; a minute)
blender-scenes: all
	tests/studies/blender/blender.sh $(BUILD)
#: make calibrate  measure error rates and power, write tests/studies/calibration/ (SHARE=0.01: a part of it)
calibrate: $(BUILD)/tests/make_calibration
	$< --threads $(shell nproc) $(if $(SHARE),--share $(SHARE) $(BUILD)/calibration,tests/studies/calibration)
#: make anchors    what our tests and the rules of other renderers find on the same images
#:                 (tests/studies/anchors; 20 CPU minutes)
anchors: $(BUILD)/tests/make_anchors $(BUILD)/oiio.so
	$< tests/studies/anchors
#: make bench      speed against Embree, Cycles and POV-Ray (BUILD/bench); bench-rays: a part of it
bench bench-rays: $(BUILD)/deps-test $(BUILD)/tests/bench $(BUILD)/pathtracer
	$(BUILD)/tests/bench --build $(BUILD) --out $(BUILD)/$@ $(patsubst bench-%,%,$(filter-out bench,$@))
#: make bvh-table  time the hierarchies and brute force on meshes in ASSAY_CS184 (minutes)
bvh-table: $(BUILD)/pathtracer
	tests/studies/bench/bvh_table.sh $(BUILD)
#: make writeup    the figures and tables of the course's write-up in one page (BUILD/writeup; 12 CPU minutes, and goes on
#:                 where it was ended; SHRINK=4: smaller images; VERDICTS=1: two scenes against Blender and POV-Ray, 8 more)
writeup: $(BUILD)/assay $(BUILD)/pathtracer
	VERDICTS=$(VERDICTS) tests/studies/writeup/writeup.sh $(BUILD) $(SHRINK)
#: make images     the two images that README shows (tools/docs/images)
images: $(BUILD)/assay $(BUILD)/pathtracer $(BUILD)/browser/package-lock.json
	$(BUILD)/assay validate -q --out $(BUILD)/images --only 12_point_plane --only 41_cornell --only 42_cornell_glass --only 46_sky --only 95_one_bounce_less
	$(BUILD)/pathtracer -q -r 360x360 -s 1024 -f $(BUILD)/images/render.png reference/scenes/42_cornell_glass.dae
	$(BUILD)/pathtracer -q -s 64 -r 240x180 --seed 1 -f $(BUILD)/images/1.exr reference/scenes/41_cornell.dae
	$(BUILD)/pathtracer -q -s 64 -r 240x180 --seed 2 -m 2 -f $(BUILD)/images/2.exr reference/scenes/41_cornell.dae
	$(BUILD)/assay compare -q --margin 0.01 --report $(BUILD)/images/compared.html $(BUILD)/images/1.exr $(BUILD)/images/2.exr || test $$? = 1
	node tests/browser/page_images.mjs $(BUILD)/browser $(BUILD)/images/index.html $(BUILD)/images/compared.html $(BUILD)/images/render.png tools/docs/images

.PHONY: slurm distros scale-live large scale pairs collada-cts blender-scenes calibrate anchors bench bench-rays bvh-table writeup images
