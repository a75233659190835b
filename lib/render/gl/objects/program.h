// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// A linked pair of shaders.
#pragma once

#include <epoxy/gl.h>

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/vector.h"

namespace polyhull::gl {

/// A shader's full text: version line for desktop GL 3.3 core or GLES 3.0, defines, common.glsl,
/// the files of \p includes, the file itself. Throws Error for a name that is not embedded.
std::string shader_text(std::string_view file, bool embedded,
                        const std::vector<std::string>& defines,
                        const std::vector<std::string>& includes);

class Program {
 public:
  Program() = default;
  /// Compiles and links for the current context. \p includes go before the fragment shader. Throws
  /// Error with the compiler's words.
  Program(std::string_view vertex, std::string_view fragment,
          const std::vector<std::string>& defines = {},
          const std::vector<std::string>& includes = {});
  ~Program();
  Program(Program&& other) noexcept;
  Program& operator=(Program&& other) noexcept;

  bool made() const { return name_ != 0; }
  void use() const;

  // Uniforms by name, while in use; names the compiler dropped are ignored. Arrays by their name
  // without [0].
  void set(const char* name, int value);
  void set(const char* name, bool value) { set(name, static_cast<int>(value)); }
  void set(const char* name, float value);
  void set(const char* name, const glm::vec2& value);
  void set(const char* name, const glm::vec3& value);
  void set(const char* name, const glm::vec4& value);
  void set(const char* name, const glm::mat4& value);
  void set(const char* name, std::span<const float> values);
  void set(const char* name, std::span<const glm::vec2> values);
  void set(const char* name, std::span<const glm::vec3> values);
  void set(const char* name, std::span<const glm::vec4> values);
  void set(const char* name, std::span<const glm::mat4> values);
  /// Connects a uniform block with a binding point.
  void set_block(const char* name, GLuint binding);

 private:
  GLint location(const char* name);
  GLuint name_ = 0;
  std::map<std::string, GLint, std::less<>> locations_;
};

}  // namespace polyhull::gl
