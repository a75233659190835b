// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/objects/program.h"

#include <glm/gtc/type_ptr.hpp>
#include <utility>

#include "base/error.h"
#include "render/gl/objects/gl_objects.h"
#include "render/gl/objects/shader_sources.h"

namespace polyhull::gl {
namespace {

std::string_view source(std::string_view file) {
  for (const ShaderSource& shader : shader_sources())
    if (shader.name == file) return shader.text;
  throw Error(Error::Kind::not_found, "Shader '{}' is not part of this build.", file);
}

GLuint compile(GLenum kind, std::string_view file, const std::string& text) {
  const GLuint shader = glCreateShader(kind);
  const char* data = text.c_str();
  glShaderSource(shader, 1, &data, nullptr);
  glCompileShader(shader);
  GLint good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (!good) {
    char log[4096] = "";
    glGetShaderInfoLog(shader, sizeof log, nullptr, log);
    glDeleteShader(shader);
    throw Error(Error::Kind::unsupported, "Shader '{}' does not compile: {}", file, log);
  }
  return shader;
}

}  // namespace

std::string shader_text(std::string_view file, bool embedded,
                        const std::vector<std::string>& defines,
                        const std::vector<std::string>& includes) {
  std::string text = embedded ? "#version 300 es\nprecision highp float;\nprecision highp int;\n"
                                "precision highp sampler2D;\nprecision highp sampler2DArray;\n"
                                "precision highp usampler2D;\nprecision highp sampler3D;\n"
                              : "#version 330 core\n";
  for (const std::string& define : defines) text += "#define " + define + "\n";
  text += source("common.glsl");
  for (const std::string& include : includes) text += source(include);
  text += source(file);
  return text;
}

Program::Program(std::string_view vertex, std::string_view fragment,
                 const std::vector<std::string>& defines,
                 const std::vector<std::string>& includes) {
  const bool embedded = is_embedded();
  const GLuint first =
      compile(GL_VERTEX_SHADER, vertex, shader_text(vertex, embedded, defines, {}));
  GLuint second = 0;
  try {
    second =
        compile(GL_FRAGMENT_SHADER, fragment, shader_text(fragment, embedded, defines, includes));
  } catch (...) {
    glDeleteShader(first);
    throw;
  }
  name_ = glCreateProgram();
  glAttachShader(name_, first);
  glAttachShader(name_, second);
  glLinkProgram(name_);
  glDeleteShader(first);
  glDeleteShader(second);
  GLint good = 0;
  glGetProgramiv(name_, GL_LINK_STATUS, &good);
  if (!good) {
    char log[4096] = "";
    glGetProgramInfoLog(name_, sizeof log, nullptr, log);
    glDeleteProgram(std::exchange(name_, 0));
    throw Error(Error::Kind::unsupported, "Shaders '{}' and '{}' do not link: {}", vertex, fragment,
                log);
  }
}

Program::~Program() {
  if (name_ != 0 && !context_gone()) glDeleteProgram(name_);
}
Program::Program(Program&& other) noexcept
    : name_(std::exchange(other.name_, 0)), locations_(std::move(other.locations_)) {}
Program& Program::operator=(Program&& other) noexcept {
  std::swap(name_, other.name_);
  std::swap(locations_, other.locations_);
  return *this;
}

void Program::use() const {
  glUseProgram(name_);
}

GLint Program::location(const char* name) {
  const auto found = locations_.find(std::string_view(name));
  if (found != locations_.end()) return found->second;
  return locations_[name] = glGetUniformLocation(name_, name);
}

void Program::set(const char* name, int value) {
  glUniform1i(location(name), value);
}
void Program::set(const char* name, float value) {
  glUniform1f(location(name), value);
}
void Program::set(const char* name, const glm::vec2& value) {
  glUniform2fv(location(name), 1, glm::value_ptr(value));
}
void Program::set(const char* name, const glm::vec3& value) {
  glUniform3fv(location(name), 1, glm::value_ptr(value));
}
void Program::set(const char* name, const glm::vec4& value) {
  glUniform4fv(location(name), 1, glm::value_ptr(value));
}
void Program::set(const char* name, const glm::mat4& value) {
  glUniformMatrix4fv(location(name), 1, GL_FALSE, glm::value_ptr(value));
}
void Program::set(const char* name, std::span<const float> values) {
  if (values.empty()) return;
  glUniform1fv(location(name), static_cast<GLsizei>(values.size()), values.data());
}
void Program::set(const char* name, std::span<const glm::vec2> values) {
  if (values.empty()) return;
  glUniform2fv(location(name), static_cast<GLsizei>(values.size()), glm::value_ptr(values[0]));
}
void Program::set(const char* name, std::span<const glm::vec3> values) {
  if (values.empty()) return;
  glUniform3fv(location(name), static_cast<GLsizei>(values.size()), glm::value_ptr(values[0]));
}
void Program::set(const char* name, std::span<const glm::vec4> values) {
  if (values.empty()) return;
  glUniform4fv(location(name), static_cast<GLsizei>(values.size()), glm::value_ptr(values[0]));
}
void Program::set(const char* name, std::span<const glm::mat4> values) {
  if (values.empty()) return;
  glUniformMatrix4fv(location(name), static_cast<GLsizei>(values.size()), GL_FALSE,
                     glm::value_ptr(values[0]));
}

void Program::set_block(const char* name, GLuint binding) {
  const GLuint index = glGetUniformBlockIndex(name_, name);
  if (index != GL_INVALID_INDEX) glUniformBlockBinding(name_, index, binding);
}

}  // namespace polyhull::gl
