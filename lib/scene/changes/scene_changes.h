// SPDX-License-Identifier: LGPL-2.1-or-later
/// \file
/// How a scene's lights and nodes are to differ from what its file says, as people write it:
///
///     lamp intensity=0.5; "key light" colour=1,0.8,0.6 move=0,-0.2,0; 3 turn=0,90,0 size=2; * intensity=0.1
///     door turn=0,-80,0; "old vase" visible=no
///
/// Entries end with a semicolon. Each names lights (all of that name, one by its number from 1 on,
/// or * for all) or nodes (all of that name), a name with spaces or semicolons in quotes, and says what
/// changes. Of lights:
/// - `intensity`: factor on the brightness, 0 to 1e6;
/// - `colour`: red, green and blue (linear, 0 to 1e6) in the place of the light's own, as bright as its
///   strongest channel where the largest of them is 1;
/// - `move`: metres along x, y and z; of a sun nothing changes;
/// - `turn`: degrees about x, then y, then z, through the light's centre; a sun goes around the scene;
/// - `size`: factor on width and height, 0.001 to 1000, the power staying the same.
/// Of nodes, with all that hangs on them, children and lights:
/// - `move`, `turn`, `scale`: likewise along the scene's axes, through the node's own origin, from where
///   the file or its animation has it; what a node above it does comes on top;
/// - `visible`: yes or no; a hidden lamp gives no light.
/// Of entries for the same light or node all hold, the later ones after the earlier ones; of `visible`
/// the last one. Cameras stay where the file has them, and of a sun only the direction follows its node.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/animation/scene_pose.h"
#include "scene/scene.h"

namespace polyhull {

struct LightChange {
  std::string light;    ///< as written, without quotes
  bool quoted = false;  ///< it is a name, even if it looks like a number or is a star
  float intensity = 1.0f;
  std::optional<Vec3f> colour;
  Vec3f move{0.0f};
  Vec3f turn{0.0f};
  float size = 1.0f;
};

/// Throws Error (bad_input) that says which part of \p text is not understood; it may have 4096 bytes.
std::vector<LightChange> parse_light_changes(std::string_view text);

/// Changes \p lights, those of a scene within \p bounds. Returns which of the lights that are named are
/// not there, and which are, in a sentence that begins with \p scene; empty: all are there.
std::string change_lights(const std::vector<LightChange>& changes, const Bounds& bounds,
                          const std::string& scene, std::vector<Light>& lights);

struct NodeChange {
  std::string node;
  Vec3f move{0.0f};
  Vec3f turn{0.0f};
  float scale = 1.0f;
  std::optional<bool> visible;
};

/// Throws Error (bad_input) that says which part of \p text is not understood, as parse_light_changes().
std::vector<NodeChange> parse_node_changes(std::string_view text);

/// Brings \p scene, as its file gave it, into \p pose: its animation at that time, and on top of it the
/// changes of nodes. In a scene that has no nodes each mesh is a node with its name and the scene's origin. Lights stay as
/// many as they are, and so do meshes and their vertices unless nodes are hidden; mirror images have the winding of
/// their triangles turned round. Returns which nodes are
/// named that are not there, as change_lights(). Throws Error (bad_input) for nodes that are not
/// understood, for an animation that is not there, where nothing is left to be seen, or anything is beyond
/// 1e6 m.
std::string pose_scene(const ScenePose& pose, Scene& scene);

/// Whether a mesh of \p scene that shows a light is elsewhere than that light of \p lights; lights beyond
/// the scene's own, or of other meshes, do not count.
bool lamps_differ(const Scene& scene, const std::vector<Light>& lights);

/// Brings these meshes, and their lights, there; how bright they are stays.
void move_lamps(Scene& scene, const std::vector<Light>& lights);

}  // namespace polyhull
