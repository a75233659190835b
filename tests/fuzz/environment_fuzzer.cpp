// SPDX-License-Identifier: LGPL-2.1-or-later
// libFuzzer entry: any bytes as a picture of the light from all around, and that light.
#include <cmath>
#include <cstdlib>

#include "base/error.h"
#include "environment/environment.h"
#include "input_file.h"

using namespace polyhull;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto light = load_environment(
        fuzz::input_file({reinterpret_cast<const char*>(data), size}, "light.hdr"), 30.0);
    const auto finite = [](const Vec3f& v) { return std::isfinite(v.x + v.y + v.z); };
    for (const Vec3f& way : {Vec3f(0, 1, 0), Vec3f(1, 0, 0), Vec3f(0.1f, -3.0f, 0.2f)})
      if (!finite(light->radiance(way)) || !finite(light->irradiance(glm::normalize(way))))
        std::abort();
    for (const Vec2f& square : {Vec2f(0.0f), Vec2f(0.3f, 0.9f), Vec2f(0.999f)})
      if (!finite(light->sample(square).radiance)) std::abort();
    for (const EnvironmentPart& part : light->parts(8))
      if (!finite(part.irradiance)) std::abort();
  } catch (const Error&) {
  }
  return 0;
}
