# SPDX-License-Identifier: LGPL-2.1-or-later
# Shared by pipelines/*.sh and tests/run.sh (sourced, not run): installs the Debian packages that are
# missing and builds polyhull. A second call finds nothing to do and says so.

polyhull_source=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# POLYHULL_BUILD_DIR names another build folder, which is used as it is.
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

# For the elements, the tools that they need, and a film of them.
polyhull_packages_demo=(
  g++ meson ninja-build mold pkg-config python3
  libgstreamer1.0-dev libgstreamer-plugins-base1.0-dev
  libepoxy-dev libegl-dev libfmt-dev libglm-dev libembree-dev libstb-dev
  libtinygltf-dev libtinyobjloader-dev nlohmann-json3-dev libflatbuffers-dev flatbuffers-compiler
  libcli11-dev libpcap-dev libopencv-imgproc-dev libsqlite3-dev liblz4-dev libzstd-dev
  libturbojpeg0-dev libvpx-dev libyuv-dev
  gstreamer1.0-tools gstreamer1.0-plugins-base gstreamer1.0-plugins-good gstreamer1.0-plugins-ugly
  gstreamer1.0-gl libgl1-mesa-dri libegl1
)
# For all else that is built.
polyhull_packages_build=(
  "${polyhull_packages_demo[@]}" libopencv-dev libopencv-contrib-dev libceres-dev libyaml-cpp-dev
)
# For cameras, files, displays and networks of all kinds.
polyhull_packages_run=(
  gstreamer1.0-plugins-bad gstreamer1.0-libav gstreamer1.0-x glib-networking openssl
)
polyhull_packages_test=(
  libgtest-dev libgmp-dev libcgal-dev python3-gi gir1.2-gstreamer-1.0 gir1.2-gst-plugins-base-1.0
  python3-flatbuffers libaravis-dev libusb-1.0-0-dev iproute2 clang-format ccache
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

# Where ccache is installed, meson uses it. What it keeps fits every clone: paths count from the build
# folder, and precompiled headers are told apart by what is in them.
export CCACHE_DEPEND=1 CCACHE_NOHASHDIR=1 CCACHE_BASEDIR=${CCACHE_BASEDIR:-$polyhull_source}
export CCACHE_SLOPPINESS=${CCACHE_SLOPPINESS:-pch_defines,time_macros,include_file_mtime,include_file_ctime}

# polyhull_configure DIRECTORY [MESON OPTION...]: makes DIRECTORY a build folder with these options.
polyhull_configure() {
  local directory=$1
  shift
  if [ ! -f "$directory/build.ninja" ]; then
    say "configuring $directory"
    if command -v mold >/dev/null; then export CXX_LD=${CXX_LD:-mold}; fi
    meson setup "$directory" "$polyhull_source" "$@"
  else
    meson configure "$directory" "$@" >/dev/null
  fi
}

# polyhull_build_targets TARGET...: builds these in $polyhull_build, without assertions, -O3 where a
# benchmark asks for it. The tests use the same folder: what is built is built once.
polyhull_build_targets() {
  $polyhull_installed && return
  [ -f "$polyhull_build/build.ninja" ] ||
    polyhull_configure "$polyhull_build" --buildtype=release -Dtests=false
  say "building $* (nothing to do where nothing changed)"
  ninja -C "$polyhull_build" "$@"
}

# polyhull_programs TOOL...: installs what the elements and these tools need, and builds them.
polyhull_programs() {
  $polyhull_installed && return
  local packages=("${polyhull_packages_demo[@]}") tool
  for tool in "$@"; do
    case $tool in
      polyhull-rig | polyhull-calibrate) packages=("${polyhull_packages_build[@]}") ;;
    esac
  done
  polyhull_install "${packages[@]}" "${polyhull_packages_run[@]}"
  # A build folder from before these libraries were installed does without the tools that need them.
  for tool in "$@"; do
    [ ! -f "$polyhull_build/build.ninja" ] || grep -q "^build tools/$tool:" "$polyhull_build/build.ninja" ||
      polyhull_configure "$polyhull_build" -Dcalibration=enabled
  done
  polyhull_build_targets plugins/libgstpolyhull.so "${@/#/tools/}"
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
