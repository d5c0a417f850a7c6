#!/bin/bash
# tools/packaging/deb.sh BUILD VERSION OUT: Debian packages of what BUILD holds: assay (programs, scenes, references,
# manual), libassay1, libassay-dev, python3-assay. Needs dpkg-dev; dependencies on libraries are those that
# dpkg-shlibdeps finds. The maintainer is DEBFULLNAME <DEBEMAIL>, or else the committer of the last commit.
set -euo pipefail
build=${1:?usage: tools/packaging/deb.sh BUILD VERSION OUT} version=${2:?} out=${3:?}
mkdir -p "$out"
out=$(realpath "$out")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
umask 022
arch=$(dpkg --print-architecture) lib=usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)
maker="${DEBFULLNAME:-$(git log -1 --format=%cn)} <${DEBEMAIL:-$(git log -1 --format=%ce)}>"
date=$(date -R -d "@${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || date +%s)}")

make -s install BUILD="$build" PREFIX=/usr DESTDIR="$work/all"
cd "$work"
mkdir -p libassay1/$lib libassay1/usr/lib/assay libassay-dev/$lib/pkgconfig libassay-dev/usr/include python3-assay/usr/lib/python3/dist-packages/assay debian
install -m 644 all/usr/lib/libassay.so.1 libassay1/$lib
mv all/usr/lib/assay/oiio.so libassay1/usr/lib/assay
mv all/usr/include/assay.h libassay-dev/usr/include
sed "s,^libdir=.*,libdir=/$lib," all/usr/lib/pkgconfig/assay.pc >libassay-dev/$lib/pkgconfig/assay.pc
ln -s libassay.so.1 libassay-dev/$lib/libassay.so
cp "$OLDPWD"/tools/python/assay/*.py python3-assay/usr/lib/python3/dist-packages/assay
rm -r all/usr/lib all/usr/include
mkdir -p all/usr/share/zsh/vendor-completions
mv all/usr/share/zsh/site-functions/* all/usr/share/zsh/vendor-completions
rmdir all/usr/share/zsh/site-functions
# Scripts keep the executable bit, data do not.
find all/usr/share -type f -exec chmod 644 {} +
find all/usr/share/assay -type f -exec awk 'FNR == 1 && /^#!/ { print FILENAME }' {} + | xargs -r chmod 755
gzip -9n all/usr/share/man/man1/*
mv all assay # all that is left
strip --strip-unneeded assay/usr/bin/* libassay1/$lib/*.so* libassay1/usr/lib/assay/*.so

# needs PACKAGE FILE...: the libraries that they are linked with.
printf 'Source: assay\n\nPackage: assay\nArchitecture: any\n\nPackage: libassay1\nArchitecture: any\n' >debian/control
needs() {
    local package=$1
    shift
    dpkg-shlibdeps -p"$package" -O -llibassay1/$lib "$@" 2>/dev/null | sed 's/^[^=]*Depends=//'
}

# package NAME SECTION ARCHITECTURE DEPENDS WHAT TEXT
package() {
    local name=$1 doc=$1/usr/share/doc/$1
    mkdir -p "$doc" "$name/DEBIAN"
    printf 'assay (%s) unstable; urgency=medium\n\n  * This version; see tools/CHANGELOG.md of the sources.\n\n -- %s  %s\n' \
        "$version" "$maker" "$date" | gzip -9n >"$doc/changelog.gz"
    printf 'Copyright (C) 2026 the Assay authors\n\nLicense: GPL-3.0-or-later. The text is in /usr/share/common-licenses/GPL-3.\n' >"$doc/copyright"
    cat >"$name/DEBIAN/control" <<END
Package: $name
Source: assay
Version: $version
Section: $2
Priority: optional
Architecture: $3
Maintainer: $maker
Installed-Size: $(du -sk "$name" | cut -f 1)
Depends: $4
Description: $5
$(fold -s -w 76 <<<"$6" | sed 's/ *$//; s/^/ /')
END
    (cd "$name" && find . -type f ! -path './DEBIAN/*' -printf '%P\0' | xargs -0 md5sum >DEBIAN/md5sums)
    dpkg-deb --root-owner-group --build "$name" "$out" >/dev/null
    echo "$out/${name}_${version}_$3.deb"
}
printf 'libassay 1 libassay1 (>= %s)\n' "$version" >libassay1.shlibs
what="A comparison says EQUIVALENT within declared margins, DIFFERENT, or INCONCLUSIVE, with a stated error rate and the smallest error that would have been found."
package libassay1 libs "$arch" "$(needs libassay1 libassay1/$lib/libassay.so.1 libassay1/usr/lib/assay/oiio.so)" \
    "statistical comparison of rendered images (library)" "$what"
mkdir -p libassay1/DEBIAN
cp libassay1.shlibs libassay1/DEBIAN/shlibs
printf 'activate-noawait ldconfig\n' >libassay1/DEBIAN/triggers
dpkg-deb --root-owner-group --build libassay1 "$out" >/dev/null
package libassay-dev libdevel "$arch" "libassay1 (= $version)" "statistical comparison of rendered images (development files)" "$what"
package assay graphics "$arch" "$(needs assay assay/usr/bin/assay assay/usr/bin/pathtracer), libassay1 (= $version), bubblewrap, unzip" \
    "path tracer, and the harness that proves a path tracer right" "$what It judges renderers on a suite of scenes against stored references of Blender Cycles and POV-Ray, grades students' submissions, and renders COLLADA scenes."
package python3-assay python all "python3, python3-numpy, libassay1 (>= $version)" "statistical comparison of rendered images (Python 3)" "$what With assertions for pytest."
