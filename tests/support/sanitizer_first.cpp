// SPDX-License-Identifier: LGPL-2.1-or-later
// Starts the address sanitizer, where it is preloaded (tests/sanitized.sh), before the constructors of
// all libraries. It would start at the first malloc otherwise, and that is one of libgpg-error, within
// bindtextdomain: the sanitizer asks for translations there, unlocks what it has not locked, and the next
// bindtextdomain (gst_init) waits for ever. Programs that this one starts run without it.
#include <dlfcn.h>

#include <algorithm>
#include <string_view>

namespace {

// The C library has no environment yet: it comes as an argument.
void start(int, char**, char** environment) {
  const auto is_preload = [](const char* entry) {
    return std::string_view(entry).starts_with("LD_PRELOAD=");
  };
  char** end = environment;
  while (*end != nullptr) ++end;
  if (std::none_of(environment, end, is_preload)) return;
  void* const initialise = dlsym(RTLD_DEFAULT, "__asan_init");
  if (initialise == nullptr) return;  // another library is preloaded
  char** const kept = std::remove_if(environment, end, is_preload);
  *std::remove_if(environment, kept, [](const char* entry) {
    return std::string_view(entry).starts_with("LD_LIBRARY_PATH=");
  }) = nullptr;
  reinterpret_cast<void (*)()>(initialise)();
}

[[gnu::section(".preinit_array"), gnu::used]] void (*const start_first)(int, char**,
                                                                        char**) = start;

}  // namespace
