#!/bin/bash
# tests/end_to_end/limits.sh BUILD: what a file or a command line asks for is limited: beyond that one line says so,
# with exit status 3 and no output file, within 20 s and 8 GiB of address space. Prints "ok NAME" or "not ok NAME: why".
# (Faults of COLLADA files: tests/bad.)
set -u
build=$(realpath "${1:?usage: tests/end_to_end/limits.sh BUILD}")
pathtracer=$build/pathtracer assay=$build/assay scene=reference/scenes/41_cornell.dae
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
failures=0
ulimit -v 8388608

# refused NAME PATTERN COMMAND...: the outputs of all commands are $tmp/out.*
refused() {
    local name=$1 pattern=$2 status
    shift 2
    timeout 20 "$@" >"$tmp/said" 2>"$tmp/err" </dev/null
    status=$?
    if [ $status -eq 3 ] && [ "$(wc -l <"$tmp/err")" -eq 1 ] && cat "$tmp/err" "$tmp/said" | grep -q -- "$pattern" && ! ls "$tmp"/out.* >/dev/null 2>&1; then
        echo "ok limits: $name"
    else
        echo "not ok limits: $name: status $status, no '$pattern' in one line, or a file: $(head -c 500 "$tmp/err") $(ls "$tmp"/out.* 2>/dev/null)"
        failures=$((failures + 1))
    fi
}
render() { # NAME PATTERN ARGUMENT...
    local name=$1 pattern=$2
    shift 2
    refused "$name" "$pattern" "$pathtracer" -q -s 1 -f "$tmp/out.exr" "$@" "$scene"
}

# Numbers of the command line.
for option in "-b nan" "-d inf" "--error nan%" "--time inf" "--time 1e308h" "--write-every nan" "-a 8 nan" "--adaptive-unbiased nan" \
    "--roulette nan" "-s 99999999999" "--seed 18446744073709551616" "-m 1000000" "-l 1000000000" "-t 100000" "-p 0 0 2147483647 1" \
    "-r 1000000 1000000"; do
    render "pathtracer $option" "is not a \|is neither" $option
done
render "more pixels than memory" "out of memory for moments of 65535 x 65535 pixels" -r 65535 65535
for option in "--margin nan" "--margin-tile inf" "--margin -1" "--alpha nan" "--alpha 0" "--spp-a 1e400"; do
    refused "assay compare $option" "is not a " "$assay" compare $option "$tmp/out.a" "$tmp/out.b"
done

# Images of 10^6 x 10^6 pixels in a few bytes.
printf 'PF\n1000000 1000000\n-1.0\n' >"$tmp/big.pfm"
printf '#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n\0\0\0\0' >"$tmp/big.hdr"
ihdr='IHDR\x00\x0f\x42\x40\x00\x0f\x42\x40\x08\x02\x00\x00\x00'
# gzip ends with the checksum that PNG wants, in the other order of bytes.
crc=$(printf "$ihdr" | gzip -c | tail -c 8 | head -c 4 | od -An -tx1 | awk '{ printf "\\x%s\\x%s\\x%s\\x%s", $4, $3, $2, $1 }')
{ printf '\x89PNG\r\n\x1a\n\x00\x00\x00\x0d' && printf "$ihdr$crc" && printf '\x00\x00\x00\x10IDAT' && head -c 100 /dev/zero; } >"$tmp/big.png"
cp tests/fuzz/seeds/moments-tiny.exr "$tmp/big.exr"
at=$(grep -abo dataWindow "$tmp/big.exr" | head -n 1 | cut -d : -f 1)
# Behind the name, its type, its size and the lower corner: 999999 999999.
printf '\x3f\x42\x0f\x00\x3f\x42\x0f\x00' | dd of="$tmp/big.exr" bs=1 seek=$((at + 29)) conv=notrunc status=none
for kind in pfm hdr png; do
    refused "$kind of 10^6 x 10^6" "1000000 *x *1000000" "$assay" compare --curve srgb "$tmp/big.$kind" "$tmp/big.$kind"
done
refused "exr of 10^6 x 10^6" "big.exr: cannot read" "$assay" compare "$tmp/big.exr" "$tmp/big.exr"
refused "a share of 10^6 x 10^6" "Invalid width (1000000)" "$assay" merge "$tmp/out.exr" "$tmp/big.exr" "$tmp/big.exr"
for kind in exr hdr; do
    render "a sky of 10^6 x 10^6, $kind" "big.$kind: cannot read" -e "$tmp/big.$kind"
done

# A PNG of 64 x 64 pixels with 2 MB that inflate to 2 GB behind them is refused; the same in its texts is skipped.
png() { # FILE BYTES TEXTS: an image with so many bytes in its stream, and texts of a MB each
    python3 - "$@" <<'END'
import struct, sys, zlib
def chunk(name, data): return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
stream, c = b"", zlib.compressobj(9)
rest = int(sys.argv[2])
while rest > 0:
    stream += c.compress(bytes(min(rest, 1 << 20)))
    rest -= 1 << 20
stream += c.flush()
text = chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(7 << 20), 9))
open(sys.argv[1], "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 64, 64, 8, 2, 0, 0, 0)) +
                              text * int(sys.argv[3]) + chunk(b"IDAT", stream) + chunk(b"IEND", b""))
END
}
if png "$tmp/right.png" $((64 * 193)) 1; then
    png "$tmp/bomb.png" 2000000000 0
    png "$tmp/texts.png" $((64 * 193)) 300
    ulimit -S -t 4
    for file in right texts; do
        "$assay" compare --curve srgb "$tmp/$file.png" "$tmp/$file.png" >"$tmp/said" 2>&1 </dev/null
        grep -q "A and B are the same image" "$tmp/said" && echo "ok limits: a PNG, $file" ||
            { echo "not ok limits: a PNG, $file: $(cat "$tmp/said")" && failures=$((failures + 1)); }
    done
    refused "a PNG that inflates to 2 GB" "its data are more than its pixels" "$assay" compare --curve srgb "$tmp/bomb.png" "$tmp/right.png"
    ulimit -S -t unlimited
else echo "skip limits: PNG files that inflate to more: no python3"; fi

# Files that block or never end, wherever a file is read; a results.json may name such a file.
mkfifo "$tmp/fifo.exr" "$tmp/fifo.png" "$tmp/fifo.json" "$tmp/fifo.rubric" "$tmp/fifo.dae" "$tmp/fifo.info"
refused "a FIFO as EXR" "fifo.exr: cannot read: Operation not supported" "$assay" compare "$tmp/fifo.exr" "$tmp/fifo.exr"
refused "a FIFO as PNG" "fifo.png: cannot read: Operation not supported" "$assay" compare --curve srgb "$tmp/fifo.png" "$tmp/fifo.png"
refused "a FIFO as results" "Operation not supported" "$assay" report "$tmp/fifo.json"
refused "a FIFO to be made again" "Operation not supported\|not " "$assay" reproduce "$tmp/fifo.json"
refused "a FIFO as a rubric" "fifo.rubric: cannot read: Operation not supported" "$assay" grade --check-rubric "$tmp/fifo.rubric"
refused "a FIFO as an engine" "Operation not supported" "$assay" validate --only 12_point_plane -o "$tmp/out.d" --engine "$tmp/fifo.json"
refused "a FIFO as a scene" "fifo.dae: cannot read: Operation not supported" "$pathtracer" -q -f "$tmp/out.exr" "$tmp/fifo.dae"
render "a FIFO as a camera" "fifo.info: cannot read: Operation not supported" -c "$tmp/fifo.info"
refused "a device as a scene" "zero: cannot read: Operation not supported" "$pathtracer" -q -f "$tmp/out.exr" /dev/zero
refused "a FIFO as appeals" "fifo.info: Operation not supported" "$assay" grade --unsafe-no-sandbox -q -o "$tmp/grades" --appeals "$tmp/fifo.info" tests/end_to_end/quick.rubric "$tmp"

# Deep nesting, huge numbers, long texts.
head -c 100000 /dev/zero | tr '\0' '[' >"$tmp/deep.json"
refused "results nested 10^5 deep" "deep.json:1: maximum parsing depth" "$assay" report "$tmp/deep.json"
refused "an engine nested 10^5 deep" "deep.json:1: maximum parsing depth" "$assay" validate --only 12_point_plane -o "$tmp/out.d" --engine "$tmp/deep.json"
mkdir "$tmp/suite"
cp reference/scenes/12_point_plane.dae "$tmp/suite"
sed 's/"depth": [0-9]*/"depth": 1e400/' reference/scenes/12_point_plane.json >"$tmp/suite/12_point_plane.json"
refused "a number beyond all in a scene's json" "12_point_plane.json" "$assay" validate --suite "$tmp/suite" -o "$tmp/out.d"
head -c 3000000 /dev/zero | tr '\0' 'a' >"$tmp/long.rubric"
refused "a rubric of 3 MB" "more than 1 MiB" "$assay" grade --check-rubric "$tmp/long.rubric"
sed 's/64 64/1000000 1000000/' tests/end_to_end/quick.rubric >"$tmp/big.rubric"
refused "a rubric's image of 10^6 x 10^6" "'1000000' is not a whole number from 16 to 4096" "$assay" grade --check-rubric "$tmp/big.rubric"
printf '50 35 1.5 0.1 100\n0.1 nan 4.2 0 0.8 0\n90 0 4.2 0.01 100\n1 0 0 0 1 0 0 0 1\n480 360 570\n4.7 0.05\n' >"$tmp/nan.info"
render "a camera at no place" "nan.info" -c "$tmp/nan.info"
sed 's,<vcount>[^<]*<,<vcount>1000000000<,' tests/bad/00_valid.dae >"$tmp/corners.dae"
refused "a polygon of 10^9 corners" "corners.dae:[0-9]*: " "$pathtracer" -q -f "$tmp/out.exr" "$tmp/corners.dae"
sed 's/count="4" stride="3"/count="1000000000" stride="3"/' tests/bad/00_valid.dae >"$tmp/corners.dae"
refused "10^9 vertices" "corners.dae:[0-9]*: " "$pathtracer" -q -f "$tmp/out.exr" "$tmp/corners.dae"
[ $failures -eq 0 ]
