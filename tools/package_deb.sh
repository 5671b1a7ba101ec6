#!/usr/bin/env bash
# Makes a Debian package of a program that was built on Debian (or Ubuntu): out/fmlgs_VERSION_ARCHITECTURE.deb, with
# man pages and completions that the program writes itself. The same program and commit make the same bytes.
#
# usage: tools/package_deb.sh PROGRAM     (tools/dist.sh builds it)
set -euo pipefail
program=$(realpath "${1:?usage: tools/package_deb.sh PROGRAM}")
cd "$(dirname "$0")/.."

for command in dpkg-deb dpkg-shlibdeps strip; do
    command -v "$command" >/dev/null || {
        echo "package: '$command' is missing; apt-get install dpkg-dev binutils" >&2
        exit 1
    }
done
version=$(tools/version.sh --number)
architecture=$(dpkg --print-architecture)
export SOURCE_DATE_EPOCH
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || date +%s)}
day=$(date -u -d "@$SOURCE_DATE_EPOCH" +%F)
umask 022
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
root=$work/root
share=$root/usr/share

install -D -m 755 "$program" "$root/usr/bin/fmlgs"
strip --strip-all --remove-section=.comment "$root/usr/bin/fmlgs"
"$program" generate "$work/made"
install -D -m 644 -t "$share/man/man1" "$work"/made/man/*.1
gzip -9n "$share"/man/man1/*.1
install -D -m 644 "$work/made/completions/fmlgs.bash" "$share/bash-completion/completions/fmlgs"
install -D -m 644 "$work/made/completions/fmlgs.zsh" "$share/zsh/vendor-completions/_fmlgs"
install -D -m 644 "$work/made/completions/fmlgs.fish" "$share/fish/vendor_completions.d/fmlgs.fish"

install -D -m 644 packaging/linux/fmlgs.desktop "$share/applications/fmlgs.desktop"
install -D -m 644 packaging/linux/fmlgs.mime.xml "$share/mime/packages/fmlgs.xml"
sed "s/@DATE@/$day/; s/version=\"0.1.0\" date/version=\"$version\" date/" packaging/linux/io.github.fmlgs.fmlgs.metainfo.xml |
    install -D -m 644 /dev/stdin "$share/metainfo/io.github.fmlgs.fmlgs.metainfo.xml"
install -D -m 644 assets/icon/fmlgs.svg "$share/icons/hicolor/scalable/apps/fmlgs.svg"
for size in 16 32 48 64 128 256; do
    install -D -m 644 "assets/icon/fmlgs-$size.png" "$share/icons/hicolor/${size}x$size/apps/fmlgs.png"
done

documents=$share/doc/fmlgs
install -D -m 644 packaging/debian/copyright "$documents/copyright"
install -D -m 644 -t "$documents" README.md
install -D -m 644 -t "$documents/docs" docs/*.md
install -D -m 644 -t "$documents/docs/notes" docs/notes/*.md
install -D -m 644 -t "$documents/docs/results" docs/results/*.csv
tools/third_party.py "$documents/THIRD_PARTY.md" >/dev/null
{
    echo "fmlgs ($version) unstable; urgency=medium"
    printf '\n  * CHANGELOG.md tells what is new.\n\n'
    echo " -- The FMLGS contributors <fmlgs@users.noreply.github.com>  $(LC_ALL=C date -u -R -d "@$SOURCE_DATE_EPOCH")"
} >"$documents/changelog"
install -m 644 CHANGELOG.md "$documents/CHANGELOG.md"
gzip -9n "$documents/changelog" "$documents/CHANGELOG.md" "$documents/THIRD_PARTY.md"

# Libraries that it is linked with; those that it opens at run time are in control.in.
mkdir "$work/debian"
printf 'Source: fmlgs\n\nPackage: fmlgs\nArchitecture: any\n' >"$work/debian/control"
linked=$(cd "$work" && dpkg-shlibdeps -O root/usr/bin/fmlgs 2>/dev/null | sed -n 's/^shlibs:Depends=//p')
mkdir "$root/DEBIAN"
sed -e "s/@VERSION@/$version/" -e "s/@ARCHITECTURE@/$architecture/" -e "s/@LINKED@/$linked/" \
    -e "s/@KIBIBYTES@/$(du -sk --exclude=DEBIAN "$root" | cut -f1)/" packaging/debian/control.in >"$root/DEBIAN/control"
(cd "$root" && find usr -type f -print0 | LC_ALL=C sort -z | xargs -0 md5sum) >"$root/DEBIAN/md5sums"
chmod 644 "$root"/DEBIAN/*
find "$root" -exec touch --no-dereference --date="@$SOURCE_DATE_EPOCH" {} +

mkdir -p out
package=out/fmlgs_${version}_$architecture.deb
dpkg-deb --root-owner-group -Zxz --build "$root" "$package" >/dev/null
ls -l "$package"
