#!/bin/bash
# Prove that a machine which holds nothing but git can do what README says.
#
#   tools/bare_machine.sh [options] SYSTEM ... [-- COMMAND ...]
#
# SYSTEM is debian:12, debian:13 or ubuntu:24.04. Each gets a new minimal root, with git and the
# certificates of this machine, and in it a clone of this folder's HEAD, where the commands run:
# those given, each one word in quotes, or else ./run sample, ./run test and ./run docs. In the end
# a table says what each one needed. The exit code is 1 if one failed.
#
#   --user            as a user without root; --sudo: as a user who may call sudo
#   --folder NAME     clone into this folder, such as 'with spaces'; default: wgmb
#   --offline         then all commands once more, without a network
#   --interrupted     first break each command off after 1, 2, 4, ... s as Ctrl-C does, each time
#                     followed by a try without a network; the commands must work all the same
#   --keep            keep the roots in build/bare, where --again uses them, with the commit of today
#
# Needs root, debootstrap, and for Ubuntu its keys (the package ubuntu-keyring).
set -eu
cd "$(dirname "$0")/.."
here=$PWD
who=root folder=wgmb offline= keep= again= interrupted= systems=()
while [ $# -gt 0 ]; do
    case $1 in
        --user | --sudo) who=${1#--} ;;
        --folder) folder=$2; shift ;;
        --offline | --keep | --again | --interrupted) declare "${1#--}=yes" ;;
        --) shift; break ;;
        debian:* | ubuntu:*) systems+=("$1") ;;
        *) sed -n '2,19s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
    esac
    shift
done
[ ${#systems[@]} -gt 0 ] || systems=(debian:12 debian:13)
[ $# -gt 0 ] || set -- './run sample' './run test' './run docs'
[ "$(id -u)" = 0 ] || { echo "bare_machine: needs root, to make a root of its own" >&2; exit 2; }
command -v debootstrap >/dev/null ||
    { echo "bare_machine: needs debootstrap: apt-get install debootstrap" >&2; exit 2; }

# What a download needs here, and nothing else: proxies, indices, certificates and their files.
passed=()
while IFS='=' read -r name value; do
    case $name in
        http_proxy | https_proxy | no_proxy | HTTP_PROXY | HTTPS_PROXY | NO_PROXY | PIP_INDEX_URL | \
            PIP_EXTRA_INDEX_URL | PIP_TRUSTED_HOST | PIP_DEFAULT_TIMEOUT | npm_config_registry | \
            PIP_CERT | SSL_CERT_FILE | REQUESTS_CA_BUNDLE | CURL_CA_BUNDLE | NODE_EXTRA_CA_CERTS)
            passed+=("$name=$value") ;;
    esac
done < <(env)

make_root() {  # make_root SYSTEM ROOT
    local suite mirror
    case $1 in
        debian:12) suite=bookworm ;;
        debian:13) suite=trixie ;;
        ubuntu:24.04) suite=noble ;;
        *) echo "bare_machine: $1 is none of debian:12, debian:13, ubuntu:24.04" >&2; exit 2 ;;
    esac
    mirror=${MIRROR:-http://deb.debian.org/debian} parts=main
    [ "${1%:*}" = debian ] || { mirror=${MIRROR:-http://archive.ubuntu.com/ubuntu} parts=main,universe; }
    # It mounts the root's /proc, and a killed debootstrap unmounts nothing; its namespace does.
    unshare --mount --pid --fork --kill-child --mount-proc \
        debootstrap --variant=minbase --include=git,ca-certificates --components=$parts \
        $suite "$2" "$mirror" >"$2.log" 2>&1 || { tail -5 "$2.log" >&2; return 1; }
    local file
    for file in /etc/resolv.conf /etc/hosts "${passed[@]#*=}"; do
        [[ $file != /* || ! -f $file ]] || install -D -m 644 "$file" "$2$file"
    done
    chroot "$2" useradd --create-home somebody
    [ "$who" != sudo ] || {
        chroot "$2" sh -c 'apt-get update -qq && apt-get install -y -qq sudo' >>"$2.log" 2>&1
        echo 'somebody ALL=(ALL) NOPASSWD: ALL' >"$2/etc/sudoers.d/somebody"
    }
}

# inside ROOT [--offline] COMMAND: run it in the clone, with its own processes and mounts.
inside() {
    local root=$1 home=/root user=root alone=()
    shift
    [ "$1" != --offline ] || { alone=(--net); shift; }
    [ "$who" = root ] || home=/home/somebody user=somebody
    unshare --mount --pid --fork --kill-child "${alone[@]}" bash -c '
        root=$1 user=$2 home=$3 folder=$4
        shift 4
        mount --make-rprivate /
        mount -t proc proc "$root/proc"
        mount --rbind /dev "$root/dev"
        mount -t tmpfs tmpfs "$root/dev/shm" 2>/dev/null
        ip link set lo up 2>/dev/null  # a machine without a network still reaches itself
        exec chroot --userspec="$user" "$root" env -i HOME="$home" USER="$user" LANG=C.UTF-8 \
            PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
            sh -c "cd \"\$1\" && shift && exec env \"\$@\"" sh "$home/$folder" "$@"
    ' bash "$root" "$user" "$home" "$folder" "${passed[@]}" sh -c "$1" </dev/null
}

table=() failed=0 running=
print_table() {
    echo '| system | command | exit | wall s | processor s | root MB | system packages installed |'
    echo '|---|---|---|---|---|---|---|'
    [ ${#table[@]} = 0 ] || printf '%s\n' "${table[@]}"
}

# waited COMMAND: run it as a job of its own. While a command in the foreground runs, bash handles
# no signal; here it ends all that the job has started, and prints the rows that there are.
waited() {
    local code=0
    set -m
    "$@" &
    running=$!
    set +m
    wait $running || code=$?
    running=
    return $code
}

broken_off() {  # the namespace of processes dies with unshare, which heeds no other signal
    trap '' INT TERM HUP
    [ -z "$running" ] || kill -KILL -- "-$running" 2>/dev/null || :
    echo "bare_machine: broken off by $1" >&2
    print_table
    exit $((128 + $2))
}
trap 'broken_off HUP 1' HUP
trap 'broken_off INT 2' INT
trap 'broken_off TERM 15' TERM

timed() { { time inside "$3" $5 "$4" >"$2" 2>&1; } 2>"$1"; }  # timed TIMES LOG ROOT COMMAND [--offline]
try() {  # try SYSTEM ROOT COMMAND [--offline]: run it and add a row to the table
    local log code took begun
    log="$2.$(printf %s "$3$4" | tr -c 'a-z0-9' _ | cut -c 1-60).log"
    echo "bare_machine: $1: $3 $4" >&2
    begun=$(date +%s.%N)
    TIMEFORMAT='%U %S'
    waited timed "$log.time" "$log" "$2" "$3" "$4" && code=0 || code=$?
    took=$(cat "$log.time")
    [ $code = 0 ] || { failed=1; tail -15 "$log" >&2; }
    table+=("$(awk -v name="$1" -v what="$3 $4" -v code=$code -v begun="$begun" \
        -v now="$(date +%s.%N)" -v size="$(du -sm "$2" | cut -f1)" -v installed="$(
            sed -n 's/^run: installing \(.*\)/\1/p' "$log" | grep -v / | paste -sd ' ')" \
        '{ printf "| %s | `%s` | %d | %.0f | %.0f | %d | %s |", name, what, code,
           now - begun, $1 + $2, size, installed }' <<<"$took")")
}

# interrupt SYSTEM ROOT COMMAND: break it off ever later, until it ends by itself.
interrupt() {
    local seconds=1 broken="env --default-signal=INT timeout --signal=INT --kill-after=60"
    while echo "bare_machine: $1: $3, broken off after $seconds s" >&2
        ! waited inside "$2" "$broken $seconds $3" >"$2.interrupted.log" 2>&1; do
        echo "bare_machine: $1: $3, without a network" >&2
        ! waited inside "$2" --offline "$broken 60 $3" >>"$2.interrupted.log" 2>&1 || return 0
        seconds=$((seconds * 2))
        [ $seconds -le 128 ] || return 0
    done
}

for system in "${systems[@]}"; do
    root=$here/build/bare/${system/:/-}-$who
    mkdir -p "$(dirname "$root")"
    if [ -z "$again" ] || [ ! -d "$root/home/somebody" ]; then
        rm -rf --one-file-system "$root"
        waited make_root "$system" "$root" || { failed=1; table+=("| $system | no root could be made | | | | | |"); continue; }
    fi
    home=$root/root owner=0:0
    [ "$who" = root ] || home=$root/home/somebody owner=1000:1000
    [ -d "$home/$folder" ] || git clone --quiet --no-hardlinks "$here" "$home/$folder"
    there=(git -c safe.directory='*' -C "$home/$folder")
    "${there[@]}" fetch --quiet "$here" HEAD && "${there[@]}" reset --quiet --hard FETCH_HEAD
    chown -R $owner "$home/$folder"
    for command in "$@"; do
        [ -z "$interrupted" ] || interrupt "$system" "$root" "$command"
        try "$system" "$root" "$command" ""
    done
    [ -z "$offline" ] || for command in "$@"; do try "$system" "$root" "$command" --offline; done
    [ -n "$keep$again" ] || rm -rf --one-file-system "$root"
done
print_table
exit $failed
