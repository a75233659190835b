// SPDX-License-Identifier: LGPL-2.1-or-later
#include "render/gl/subject_buffers.h"

#include <algorithm>
#include <cstddef>
#include <glm/gtc/packing.hpp>

#include "base/thread_pool.h"
#include "render/projection.h"
#include "render/subject/picture_flows.h"
#include "render/subject/soft_edge.h"

namespace polyhull {
namespace {

/// shaders/hull.vert's View, std140.
struct ViewBlock {
  glm::mat4 map_from_local{0.0f};
  glm::vec4 colour_from_map{0.0f};
  glm::vec4 pixel_from_map{0.0f};
  glm::vec4 intrinsics{1.0f};
  glm::vec4 skew_and_size{0.0f};
  glm::vec4 origin{0.0f};
  glm::vec4 lens[3] = {glm::vec4(0.0f), glm::vec4(0.0f), glm::vec4(0.0f)};
  glm::vec4 limits{1.0f};
  glm::mat3x4 colour{1.0f};  // columns with a fourth number that nothing reads
  glm::vec4 flows{-1.0f};
};
static_assert(sizeof(ViewBlock) == 16 * 17);

int rounded_up(int size) {
  return (size + 63) / 64 *
         64;  // regions of interest breathe; textures should not be remade for it
}

/// Half floats of 0 to \p count - 1, each divided by \p unit.
std::vector<std::uint16_t> halves(int count, float unit) {
  std::vector<std::uint16_t> table(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    table[static_cast<std::size_t>(i)] = glm::packHalf1x16(static_cast<float>(i) / unit);
  return table;
}

}  // namespace

void SubjectBuffers::PictureArray::grow(int least_width, int least_height, std::size_t least_layers,
                                        int least_levels) {
  const int needed = static_cast<int>(least_layers);
  gl::bind_texture(0, GL_TEXTURE_2D_ARRAY, texture.get());
  if (least_width <= width && least_height <= height && needed <= layers && least_levels <= levels)
    return;
  width = std::max(width, rounded_up(least_width));
  height = std::max(height, rounded_up(least_height));
  layers = std::max(layers, needed);
  levels = std::max(levels, least_levels);
  static_assert(1 << most_levels <= 64);  // rounded_up(): sizes can be halved so often
  for (int level = 0; level < levels; ++level)
    glTexImage3D(GL_TEXTURE_2D_ARRAY, level, static_cast<GLint>(format), width >> level,
                 height >> level, layers, 0, transfer, type, nullptr);
  gl::texture_parameters(GL_TEXTURE_2D_ARRAY, GL_LINEAR);
  if (levels > 1)
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
}

void SubjectBuffers::upload_shape(const Hull& hull) {
  glBindVertexArray(shape_array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, positions_.get());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(hull.vertices.size() * sizeof(Vec3f)),
               hull.vertices.data(), GL_STREAM_DRAW);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vec3f), nullptr);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.get());
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(hull.triangles.size() * sizeof(std::uint32_t)),
               hull.triangles.data(), GL_STREAM_DRAW);
  glBindVertexArray(0);
  shape_count_ = static_cast<GLsizei>(hull.triangles.size());
}

UploadCounts SubjectBuffers::upload_skin(const Mesh& mesh, const std::vector<Vec3>& eyes,
                                         double pixel_size, int levels, bool all_views, bool soft) {
  UploadCounts counts;
  soft_ = soft;
  find_vertices(mesh, eyes, pixel_size);
  glBindVertexArray(skin_array_.get());
  glBindBuffer(GL_ARRAY_BUFFER, skin_.get());
  glBufferData(GL_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(drawing_.vertices.size() * sizeof(HullVertex)),
               drawing_.vertices.data(), GL_STREAM_DRAW);
  const auto at = [](std::size_t offset) { return reinterpret_cast<const void*>(offset); };
  for (GLuint i = 0; i < 4; ++i) glEnableVertexAttribArray(i);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(HullVertex),
                        at(offsetof(HullVertex, position)));
  glVertexAttribPointer(1, 4, GL_UNSIGNED_SHORT, GL_TRUE, sizeof(HullVertex),
                        at(offsetof(HullVertex, weights)));
  glVertexAttribIPointer(2, 4, GL_UNSIGNED_BYTE, sizeof(HullVertex),
                         at(offsetof(HullVertex, slots)));
  glVertexAttribPointer(3, 4, GL_UNSIGNED_SHORT, GL_TRUE, sizeof(HullVertex),
                        at(offsetof(HullVertex, fill)));
  glBindVertexArray(0);

  std::vector<int> uploaded = drawing_.views;
  for (std::size_t k = 0; k < mesh.views.size(); ++k) {
    if (drawing_.slot_of_view[k] >= 0 || !can_colour(mesh.views[k].view)) continue;
    if (all_views)
      uploaded.push_back(static_cast<int>(k));  // into layers after those in use
    else
      ++counts.pictures_skipped;
  }
  upload_pictures(mesh, uploaded, levels, counts);
  const Texturing* texturing = mesh.texturing ? &*mesh.texturing : nullptr;
  use_maps_ = texturing && texturing->method == TextureMethod::blend &&
              texturing->maps.size() == mesh.views.size() && !drawing_.views.empty();
  if (use_maps_) upload_maps(mesh);
  if (!drawing_.lists.empty()) upload_lists();
  upload_flows(mesh, eyes.front());
  upload_views(mesh);
  best_ = texturing && texturing->method == TextureMethod::blend
              ? static_cast<int>(std::clamp<std::uint32_t>(texturing->cameras, 1, most_candidates))
              : 1;
  fill_range_ = fill_range(mesh);
  return counts;
}

void SubjectBuffers::upload_form(const std::vector<Vec3f>& form) {
  if (form.empty() && form_.empty()) return;
  form_.clear();
  glBindVertexArray(skin_array_.get());
  if (form.empty()) {
    glDisableVertexAttribArray(4);
  } else {
    for (const std::uint32_t vertex : drawing_.corner) form_.push_back(form[vertex]);
    glBindBuffer(GL_ARRAY_BUFFER, forms_.get());
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(form_.size() * sizeof(Vec3f)),
                 form_.data(), GL_STREAM_DRAW);
    glEnableVertexAttribArray(4);
    glVertexAttribPointer(4, 3, GL_FLOAT, GL_FALSE, sizeof(Vec3f), nullptr);
  }
  glBindVertexArray(0);
}

void SubjectBuffers::find_vertices(const Mesh& mesh, const std::vector<Vec3>& eyes,
                                   double pixel_size) {
  drawing_.clear(mesh.views.size());
  ranges_.clear();
  wide_.clear();
  std::size_t first = 0;
  const auto range_to = [&](std::size_t end) {
    const Range range{static_cast<GLint>(first), static_cast<GLsizei>(end - first)};
    first = end;
    return range;
  };
  for (const Vec3& eye : eyes) {
    const std::size_t wide = add_hull_vertices(mesh, {eye, pixel_size}, drawing_);
    if (soft_ && ranges_.empty()) draw_in(mesh, 0, drawing_);
    ranges_.push_back(range_to(wide));
    wide_.push_back(range_to(drawing_.vertices.size()));
  }
  if (soft_) add_ribbons(mesh, eyes.front(), drawing_);
  ranges_.push_back(range_to(drawing_.vertices.size()));
  rests_ = rim_shares(mesh, eyes.front(), soft_);
}

void SubjectBuffers::upload_pictures(const Mesh& mesh, const std::vector<int>& views, int levels,
                                     UploadCounts& counts) {
  if (views.empty()) return;
  int width = 0, height = 0;
  for (const int k : views) {
    const Rectangle& roi = mesh.views[static_cast<std::size_t>(k)].view.roi;
    width = std::max(width, roi.width + 2);
    height = std::max(height, roi.height + 2);
  }
  pictures_.grow(width, height, views.size(), levels + 1);
  glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, levels);  // others are older
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  // Not kept: between frames the pictures of all views would lie here in vain.
  struct Staged {
    std::vector<std::uint32_t> pixels;
    std::vector<SmallerPicture> smaller;
  };
  std::vector<Staged> staged(views.size());  // by layer
  parallel_each(views.size(), 1, 0, [&](std::size_t layer) {
    const View& view = mesh.views[static_cast<std::size_t>(views[layer])].view;
    auto& [pixels, smaller] = staged[layer];
    prepare_view_picture(view, soft_ ? soft_reach : sharp_reach, pixels);
    for (int level = 1; level <= levels; ++level)
      smaller.push_back(
          level == 1 ? halved(pixels, view.roi.width + 2, view.roi.height + 2)
                     : halved(smaller.back().pixels, smaller.back().width, smaller.back().height));
  });
  for (std::size_t layer = 0; layer < views.size(); ++layer) {
    const Rectangle& roi = mesh.views[static_cast<std::size_t>(views[layer])].view.roi;
    const auto& [pixels, smaller] = staged[layer];
    const auto upload = [&](std::size_t level, GLsizei across, GLsizei down,
                            const std::vector<std::uint32_t>& from) {
      glTexSubImage3D(GL_TEXTURE_2D_ARRAY, static_cast<GLint>(level), 0, 0,
                      static_cast<GLint>(layer), across, down, 1, GL_RGBA, GL_UNSIGNED_BYTE,
                      from.data());
    };
    upload(0, roi.width + 2, roi.height + 2, pixels);
    ++counts.pictures;
    counts.pixels += pixels.size();
    for (std::size_t level = 1; level <= smaller.size(); ++level) {
      const SmallerPicture& picture = smaller[level - 1];
      glPixelStorei(GL_UNPACK_ROW_LENGTH, picture.width);
      upload(level, std::min(picture.width, pictures_.width >> level),
             std::min(picture.height, pictures_.height >> level), picture.pixels);
    }
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  }
}

void SubjectBuffers::upload_maps(const Mesh& mesh) {
  const std::vector<OcclusionMap>& maps = mesh.texturing->maps;
  int width = 1, height = 1;
  for (const int k : drawing_.views) {
    width = std::max(width, maps[static_cast<std::size_t>(k)].width);
    height = std::max(height, maps[static_cast<std::size_t>(k)].height);
  }
  maps_.grow(width, height, drawing_.views.size());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  float coarsest = 0.0f, inset = 0.0f;
  static const std::vector<std::uint16_t> depths = halves(65536, 65534.0f),
                                          fades = halves(256, 255.0f);
  for (std::size_t layer = 0; layer < drawing_.views.size(); ++layer) {
    const auto k = static_cast<std::size_t>(drawing_.views[layer]);
    const OcclusionMap& map = maps[k];
    if (map.width <= 0 || map.height <= 0) continue;
    // One more row and column of zeros than the map has, for look-ups beyond it: the layer holds
    // older maps there.
    const int columns = std::min(map.width + 1, maps_.width),
              rows = std::min(map.height + 1, maps_.height);
    half_.assign(static_cast<std::size_t>(columns) * rows, 0);
    for (int y = 0; y < map.height; ++y) {
      const std::size_t from = static_cast<std::size_t>(y) * map.width;
      std::uint32_t* const to = half_.data() + static_cast<std::size_t>(y) * columns;
      for (int x = 0; x < map.width; ++x)
        to[x] = depths[map.depth[from + x]] | std::uint32_t{fades[map.fade[from + x]]} << 16;
    }
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, static_cast<GLint>(layer), columns, rows, 1,
                    GL_RG, GL_HALF_FLOAT, half_.data());
    const auto focal = static_cast<float>(mesh.views[k].calibration.K[0][0]);
    coarsest = std::max(coarsest, map.step * map.near / focal / (map.far - map.near));
    if (soft_) inset = std::max(inset, static_cast<float>(inset_depth(map, focal)));
  }
  // The slope of a texel or two; half floats' rounding; what was drawn in.
  depth_tolerance_ = 3.0f * coarsest + 0.002f + inset;
}

void SubjectBuffers::upload_lists() {
  constexpr std::size_t columns = 1024;  // as shaders/hull.frag
  const std::size_t rows = (drawing_.lists.size() + columns - 1) / columns;
  drawing_.lists.resize(rows * columns);
  gl::bind_texture(0, GL_TEXTURE_2D, lists_.get());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA16UI, static_cast<GLsizei>(columns),
               static_cast<GLsizei>(rows), 0, GL_RGBA_INTEGER, GL_UNSIGNED_SHORT,
               drawing_.lists.data());
  gl::texture_parameters(GL_TEXTURE_2D, GL_NEAREST);
}

void SubjectBuffers::upload_flows(const Mesh& mesh, const Vec3& eye) {
  use_flows_ = false;
  if (!use_maps_) return;
  flow_shares_.assign(drawing_.views.size(), glm::vec4(-1.0f));
  const std::vector<PictureFlow>& flows = mesh.texturing->flows;
  int width = 1, height = 1;
  for (const PictureFlow& flow : flows) {
    width = std::max(width, flow.width + 1);
    height = std::max(height, flow.height + 1);
  }
  for (const PictureFlow& flow : flows) {
    const int slot = drawing_.slot_of_view[static_cast<std::size_t>(flow.view)];
    const int other = drawing_.slot_of_view[static_cast<std::size_t>(flow.other)];
    if (slot < 0 || other < 0 || flow.offsets.empty()) continue;
    if (!use_flows_) flows_.grow(width, height, PictureFlow::most_of_view * drawing_.views.size());
    use_flows_ = true;
    glm::vec4& shares = flow_shares_[static_cast<std::size_t>(slot)];
    const int number = shares.x < 0.0f ? 0 : 1;
    shares[2 * number] = static_cast<float>(other);
    shares[2 * number + 1] = flow_share(mesh, flow, eye);
    // A row and a column of zeros more, as upload_maps().
    const std::size_t stride = 2 * (static_cast<std::size_t>(flow.width) + 1);
    offsets_.assign(stride * (static_cast<std::size_t>(flow.height) + 1), 0);
    for (int y = 0; y < flow.height; ++y)
      std::copy_n(flow.offsets.data() + 2 * static_cast<std::ptrdiff_t>(y) * flow.width,
                  2 * flow.width, offsets_.data() + static_cast<std::size_t>(y) * stride);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, PictureFlow::most_of_view * slot + number,
                    flow.width + 1, flow.height + 1, 1, GL_RG, GL_BYTE, offsets_.data());
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  }
}

void SubjectBuffers::upload_views(const Mesh& mesh) {
  std::vector<ViewBlock> blocks(view_slots);
  distortion_ = false;
  for (std::size_t slot = 0; slot < drawing_.views.size(); ++slot) {
    const auto k = static_cast<std::size_t>(drawing_.views[slot]);
    const Camera& camera = mesh.views[k].calibration;
    const View& view = mesh.views[k].view;
    ViewBlock& block = blocks[slot];

    // Map coordinates: of the occlusion map's layer, or of the whole frame where there is none.
    double x = 0.0, y = 0.0, step = 1.0, width = camera.width, height = camera.height;
    double near = 0.0, range = 1.0;
    if (use_maps_) {
      const OcclusionMap& map = mesh.texturing->maps[k];
      x = map.x, y = map.y, step = map.step, width = maps_.width, height = maps_.height;
      near = map.near, range = map.far - map.near;
    }
    const Mat3 KR = camera.K * camera.R;
    const Vec3 shift = camera.K * camera.to_camera(mesh.hull.origin);
    Mat4 pixel(KR);  // local to (px z, py z, z, 1)
    pixel[3] = Vec4(shift, 1.0);
    Mat4 map_from_pixel(0.0);
    map_from_pixel[0][0] = 1.0 / (step * width);
    map_from_pixel[2][0] = (0.5 - x / step) / width;
    map_from_pixel[1][1] = 1.0 / (step * height);
    map_from_pixel[2][1] = (0.5 - y / step) / height;
    map_from_pixel[2][2] = 1.0;
    map_from_pixel[2][3] = 1.0 / range;
    map_from_pixel[3][3] = -near / range;
    block.map_from_local = glm::mat4(map_from_pixel * pixel);
    const glm::dvec4 pixel_from_map(step * width, step * height, x - 0.5 * step, y - 0.5 * step);
    block.pixel_from_map = pixel_from_map;
    // A picture's layer has a border of one pixel; texel centres lie at halves.
    const double origin_x = view.roi.x - 1.5, origin_y = view.roi.y - 1.5;
    const double pw = pictures_.width, ph = pictures_.height;
    block.colour_from_map =
        glm::dvec4(pixel_from_map.x / pw, pixel_from_map.y / ph, (pixel_from_map.z - origin_x) / pw,
                   (pixel_from_map.w - origin_y) / ph);
    block.intrinsics = glm::dvec4(camera.K[0][0], camera.K[1][1], camera.K[2][0], camera.K[2][1]);
    block.skew_and_size = glm::dvec4(camera.K[1][0], rests_[k], 1.0 / pw, 1.0 / ph);
    block.origin = glm::dvec4(origin_x, origin_y, 0.0, 0.0);
    block.limits = glm::dvec4((view.roi.width + 1.5) / pw, (view.roi.height + 1.5) / ph, 1.0, 1.0);
    if (use_flows_) block.flows = flow_shares_[slot];
    if (use_maps_) {
      const OcclusionMap& map = mesh.texturing->maps[k];
      block.limits.z = (static_cast<float>(map.width) + 0.5f) / static_cast<float>(maps_.width);
      block.limits.w = (static_cast<float>(map.height) + 0.5f) / static_cast<float>(maps_.height);
    }
    if (mesh.texturing) block.colour = glm::mat3x4(colour_of(*mesh.texturing, camera, k));
    for (std::size_t i = 0; i < std::min<std::size_t>(camera.distortion.size(), 12); ++i)
      block.lens[i / 4][static_cast<int>(i % 4)] = static_cast<float>(camera.distortion[i]);
    distortion_ = distortion_ || camera.has_distortion();
  }
  glBindBuffer(GL_UNIFORM_BUFFER, views_.get());
  glBufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(blocks.size() * sizeof(ViewBlock)),
               blocks.data(), GL_STREAM_DRAW);
}

void SubjectBuffers::draw_shape() const {
  glBindVertexArray(shape_array_.get());
  glDrawElements(GL_TRIANGLES, shape_count_, GL_UNSIGNED_INT, nullptr);
}

void SubjectBuffers::draw_skin(std::size_t eye, gl::Program& program) const {
  if (eye + 1 < ranges_.size()) draw_range(ranges_[eye].first, ranges_[eye].count, program);
}

bool SubjectBuffers::has_wide(std::size_t eye) const {
  return eye < wide_.size() && wide_[eye].count > 0;
}

void SubjectBuffers::draw_wide(std::size_t eye, gl::Program& program) const {
  if (!has_wide(eye)) return;
  gl::bind_texture(2, GL_TEXTURE_2D, lists_.get());
  program.set("lists", 2);
  draw_range(wide_[eye].first, wide_[eye].count, program);
}

void SubjectBuffers::draw_ribbons(gl::Program& program) const {
  if (!ranges_.empty()) draw_range(ranges_.back().first, ranges_.back().count, program);
}

void SubjectBuffers::draw_range(GLint first, GLsizei count, gl::Program& program) const {
  if (count == 0) return;
  gl::bind_texture(0, GL_TEXTURE_2D_ARRAY, pictures_.texture.made() ? pictures_.texture.get() : 0);
  gl::bind_texture(1, GL_TEXTURE_2D_ARRAY, use_maps_ ? maps_.texture.get() : 0);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, views_.get());
  program.set("pictures", 0);
  program.set("maps", 1);
  program.set("use_maps", use_maps_);
  gl::bind_texture(3, GL_TEXTURE_2D_ARRAY, use_flows_ ? flows_.texture.get() : 0);
  program.set("flows", 3);
  program.set("use_flows", use_flows_);
  program.set("depth_tolerance", depth_tolerance_);
  program.set("best", best_);
  program.set("fill_range", fill_range_);
  glBindVertexArray(skin_array_.get());
  glDrawArrays(GL_TRIANGLES, first, count);
}

}  // namespace polyhull
