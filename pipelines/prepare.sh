# SPDX-License-Identifier: LGPL-2.1-or-later
# Shared by pipelines/*.sh and tests/run.sh (sourced, not run): installs the Debian packages that are
# missing and builds polyhull. A second call finds nothing to do and says so.

polyhull_source=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# Of the pipelines' own: tests/run.sh builds with assertions, in a folder of its own.
polyhull_build=${POLYHULL_BUILD_DIR:-$polyhull_source/build-release}
# An installed copy has no sources beside it: its elements and tools are where GStreamer and PATH look,
# and it writes below the folder it is called from.
polyhull_installed=false
if [ ! -f "$polyhull_source/meson.build" ]; then
  polyhull_installed=true
  polyhull_source=$PWD
fi

say() { printf '\033[1m==>\033[0m %s\n' "$*"; }
fail() { printf 'error: %s\n' "$*" >&2; exit 1; }

# polyhull_help ARGUMENT...: where one of them asks for help, prints the calling script's header and ends.
polyhull_help() {
  local argument
  for argument in "$@"; do
    case $argument in
      -h | --help) sed -n '3,/^[^#]/s/^# \{0,1\}//p' "$0"; exit 0 ;;
    esac
  done
}

polyhull_packages_build=(
  g++ meson ninja-build pkg-config python3
  libgstreamer1.0-dev libgstreamer-plugins-base1.0-dev libgstreamer-plugins-bad1.0-dev
  libepoxy-dev libegl-dev libfmt-dev libglm-dev libembree-dev libstb-dev
  libtinygltf-dev libtinyobjloader-dev nlohmann-json3-dev libflatbuffers-dev flatbuffers-compiler
  libcli11-dev libpcap-dev libopencv-dev libopencv-contrib-dev libceres-dev libyaml-cpp-dev libsqlite3-dev liblz4-dev libzstd-dev
  libturbojpeg0-dev libvpx-dev libyuv-dev
)
polyhull_packages_run=(
  gstreamer1.0-tools gstreamer1.0-plugins-base gstreamer1.0-plugins-good gstreamer1.0-plugins-bad
  gstreamer1.0-plugins-ugly gstreamer1.0-libav gstreamer1.0-gl gstreamer1.0-x libgl1-mesa-dri libegl1
  glib-networking openssl
)
polyhull_packages_test=(
  libgtest-dev libgmp-dev libcgal-dev python3-gi gir1.2-gstreamer-1.0 gir1.2-gst-plugins-base-1.0
  python3-flatbuffers libaravis-dev libusb-1.0-0-dev iproute2 clang-format
)

# polyhull_install PACKAGE...: installs those that are missing.
polyhull_install() {
  $polyhull_installed && return
  local missing=() package as_root=()
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  if [ ${#missing[@]} -eq 0 ]; then
    say "all $# Debian packages are installed"
    return
  fi
  say "installing ${#missing[@]} Debian packages: ${missing[*]}"
  command -v apt-get >/dev/null || fail "these packages are needed and there is no apt-get: ${missing[*]}"
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "installing packages needs root: run this as root or install sudo"
    as_root=(sudo)
  fi
  "${as_root[@]}" apt-get update -q
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -q --no-install-recommends "${missing[@]}"
}

# polyhull_configure DIRECTORY [MESON OPTION...]: makes DIRECTORY a build folder with these options.
polyhull_configure() {
  local directory=$1
  shift
  if [ ! -f "$directory/build.ninja" ]; then
    say "configuring $directory"
    meson setup "$directory" "$polyhull_source" "$@"
  else
    meson configure "$directory" "$@" >/dev/null
  fi
}

# polyhull_compile DIRECTORY [MESON OPTION...]: configures DIRECTORY with these options and builds
# everything that changed.
polyhull_compile() {
  $polyhull_installed && return
  polyhull_configure "$@"
  local directory=$1
  say "building $directory (nothing to do where nothing changed)"
  ninja -C "$directory"
}

# polyhull_programs: builds the plugin and the tools only, as fast as they go and without assertions.
polyhull_programs() {
  $polyhull_installed && return
  if [ ! -f "$polyhull_build/build.ninja" ]; then
    say "configuring $polyhull_build"
    meson setup "$polyhull_build" "$polyhull_source" --buildtype=release -Dtests=false
  fi
  say "building the plugin and the tools (nothing to do where nothing changed)"
  ninja -C "$polyhull_build" programs
}

# polyhull_environment: the tools and elements of the build tree, for what is run after it.
polyhull_environment() {
  if ! $polyhull_installed; then
    export GST_PLUGIN_PATH="$polyhull_build/plugins${GST_PLUGIN_PATH:+:$GST_PLUGIN_PATH}"
    export GST_REGISTRY="$polyhull_build/gst-registry.bin"
    export PATH="$polyhull_build/tools:$PATH"
  fi
  if [ -z "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then
    # Without a display, GL runs through EGL on whatever device there is, else in software.
    export GST_GL_PLATFORM=${GST_GL_PLATFORM:-egl} GST_GL_WINDOW=${GST_GL_WINDOW:-egl-device}
  fi
}
