#!/usr/bin/env bash
# What is published, built and tried as a stranger would: source distribution and wheel, twice from two folders, byte for
# byte equal; the wheel alone, installed into an empty environment with the lowest versions that are declared and no
# extra; then the wheels of the plugins, the demonstration, and tests, run from outside the source tree. Files
# in wheels have the date of the commit (SOURCE_DATE_EPOCH). `.ci/release.sh FOLDER` also copies what was built there.
set -euo pipefail
copies=${1:+$(realpath -m "$1")}
cd "$(dirname "$0")/.."
here=$PWD
python=$here/.venv/bin/python
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct)} OMP_NUM_THREADS=1

echo "source distribution and wheels, from two folders"
mkdir "$folder/first" "$folder/second"
# The checkout's own compilation serves for the first, a new one in a folder of another name for the second.
"$python" -m hatchling build --target sdist --target wheel --directory "$folder/first" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
tar --extract --gzip --file "$folder"/first/creepkit-*.tar.gz --directory "$folder"
cd "$folder"/creepkit-*/
"$python" -m hatchling build --target sdist --target wheel --directory "$folder/second" >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
cd "$here"
for plugin in plugins/*/; do
    cp -R "$plugin" "$folder/plugin"
    (cd "$plugin" && "$python" -m hatchling build --target wheel --directory "$folder/first" >/dev/null 2>&1)
    (cd "$folder/plugin" && "$python" -m hatchling build --target wheel --directory "$folder/second" >/dev/null 2>&1)
    rm -rf "$folder/plugin"
done
diff --recursive "$folder/first" "$folder/second"
"$python" .ci/wheel_content.py "$folder"/first/creepkit-*.whl "$folder"/first/creepkit-*.tar.gz

if [ -n "$copies" ]; then
    mkdir -p "$copies"
    cp "$folder"/first/* "$copies"
fi

echo "the wheel in an empty environment, with the lowest versions that are declared"
"$python" .ci/lower_bounds.py >"$folder/lowest.txt"
"$python" -m venv "$folder/env"
pip="$folder/env/bin/python -m pip --disable-pip-version-check --quiet"
if ! $pip install --constraint "$folder/lowest.txt" "$folder"/first/creepkit-*.whl 2>"$folder/log"; then
    cat "$folder/log"
    [ -z "${CI:-}" ] || exit 1
    echo "the lowest versions cannot be had here; the wheels are not tried"
    exit 0
fi
mkdir "$folder/outside" "$folder/empty"
cd "$folder/empty"
env -i HOME="$folder/empty" PATH="$folder/env/bin" creepkit simulate norton --stress 80 --set A=1e-16 --set n=5 --end-h 10 >/dev/null
cd "$here"

echo "the plugins, and tests"
$pip install --no-index --find-links "$folder/first" 'creepkit[plugins]'
cd "$folder/empty"
env -i HOME="$folder/empty" PATH="$folder/env/bin" creepkit demo >"$folder/log" 2>&1 || { cat "$folder/log"; exit 1; }
tail -n 2 "$folder/log"
cd "$here"
$pip install --constraint "$folder/lowest.txt" pytest hypothesis jsonschema packaging
$pip check
cp -R tests "$folder/outside"
cp -R --parents pyproject.toml docs/schemas.py docs/reference/schemas "$folder/outside"  # settings of pytest; schemas
cd "$folder/outside"
# The schemas that are kept are those that today's pydantic writes, not the lowest.
"$folder/env/bin/python" -m pytest -q -p no:cacheprovider --deselect tests/unit/files/test_formats.py::test_the_schemas_are_current \
    tests/conformance/test_registered.py tests/unit/core tests/unit/files tests/unit/language
