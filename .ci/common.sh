# What .ci/run and .ci/nightly share; sourced from the root of the project.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
as_root=$([ "$(id -u)" = 0 ] || echo sudo)

stage() {
    echo "---- $1, after $((SECONDS / 60)) min $((SECONDS % 60)) s"
}

# Exported Fortran, C and C++ are compiled and driven by tests; pages are opened in Chromium. PROGRAM or PROGRAM=PACKAGE.
install_programs() {
    local one missing=()
    for one in "$@"; do
        command -v "${one%=*}" >/dev/null || missing+=("${one#*=}")
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    ($as_root apt-get -qq update && $as_root apt-get -qq install -y --no-install-recommends "${missing[@]/#node/nodejs}") \
        >/dev/null 2>&1 || echo "not all of ${missing[*]} can be installed here; what needs them is skipped"
}

# Python on a machine whose only programs are bash, env, git and make.
without_compilers() {
    local tool path
    mkdir -p "$work/hidden"
    for tool in bash env git make; do
        path=$(command -v $tool) && ln -sf "$path" "$work/hidden/$tool"
    done
    OMP_NUM_THREADS=1 PATH=$work/hidden .venv/bin/python "$@"
}
