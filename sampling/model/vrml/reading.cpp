#include "sampling/model/vrml/reading.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "sampling/base/input_error.h"

namespace hilbrush::vrml {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kWarningLimit = 200;
constexpr std::size_t kUrlLimit = 16;         ///< tried of one list
constexpr std::size_t kWorkPerTriangle = 16;  ///< items that work may be spent on, for each triangle allowed
constexpr std::size_t kBaseWork = 100'000;    ///< items that any model may spend work on
constexpr std::size_t kTextItem = 16;         ///< bytes of a name that are compared in the time of a number

/// Geometry where a Shape must stand around it.
bool is_bare_geometry(const std::string& type) {
  static const std::set<std::string> types{"Box",           "Sphere",   "Cylinder", "Cone", "IndexedFaceSet",
                                           "ElevationGrid", "Extrusion"};
  return types.count(type) > 0;
}

/// Nodes that belong to a scene but never to a surface: not worth a warning.
bool is_scenery(const std::string& type) {
  static const std::set<std::string> types{
      "Viewpoint", "NavigationInfo", "Background", "Fog", "Sound", "AudioClip", "MovieTexture", "WorldInfo",
      "Script", "DirectionalLight", "PointLight", "SpotLight", "TimeSensor", "TouchSensor", "PlaneSensor",
      "SphereSensor", "CylinderSensor", "ProximitySensor", "VisibilitySensor", "ColorInterpolator",
      "CoordinateInterpolator", "NormalInterpolator", "OrientationInterpolator", "PositionInterpolator",
      "ScalarInterpolator",
      // VRML 1.0
      "Info", "FontStyle", "Normal", "NormalBinding", "OrthographicCamera", "PerspectiveCamera"};
  return types.count(type) > 0;
}

std::string quoted_list(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < std::min(names.size(), kUrlLimit); ++i) {
    out += (i ? ", '" : "'");
    for (const char c : names[i].substr(0, 120)) out += c >= ' ' && c < 127 ? c : '?';
    out += "'";
  }
  return out;
}

}  // namespace

fs::path Reading::folder_of(const Node& node) const {
  return folder_.path() / fs::path(*node.file).parent_path();
}

void Reading::warn(const Node& node, const std::string& sentence) {
  warn(std::vector<std::string>{at(node) + ": " + sentence});
}

void Reading::warn(const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences)
    if (warnings.size() < kWarningLimit && said_.insert(sentence).second) warnings.push_back(sentence);
}

const Scene& Reading::parse_text(const std::string& text, const std::string& name) {
  auto& scene = scenes_["\n" + name];  // not the path of any inlined file
  scene = std::make_unique<Scene>(parse(text, name, limits_, parse_budget_, warnings));
  return *scene;
}

std::vector<std::string> Reading::tried_urls(const Node& node, const std::vector<std::string>& all) {
  const std::size_t count = std::min(all.size(), kUrlLimit);
  const std::vector<std::string> urls(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
  for (const std::string& url : urls) spend(1 + url.size() / kTextItem, node);
  return urls;
}

const Scene* Reading::open_inline(const Node& node, const std::vector<std::string>& all_urls) {
  const std::vector<std::string> urls = tried_urls(node, all_urls);
  const auto [known, is_new] = inline_lists_.try_emplace({folder_of(node).string(), urls}, nullptr);
  if (!is_new) return known->second;
  std::string reason = "it names no file";
  for (std::size_t i = 0; i < urls.size(); ++i) {
    // Links into a file are not followed: "arm.wrl#Viewpoint" is arm.wrl.
    const auto file = images_.find(folder_of(node), urls[i].substr(0, urls[i].find('#')));
    if (!file) {
      reason = file.reason();
      continue;
    }
    const auto [found, is_first] = scenes_.try_emplace(file->string());
    if (is_first) {
      const std::string text = folder_.read(*file);
      found->second =
          std::make_unique<Scene>(parse(text, folder_.name(*file), limits_, parse_budget_, warnings));
    }
    return known->second = found->second.get();
  }
  if (missing_inline_count_++ == 0) first_missing_inline_ = quoted_list(urls) + ": " + reason;
  warn(node, "the inlined file cannot be read (" + reason + "); tried " + quoted_list(urls));
  return nullptr;
}

int Reading::open_image(const Node& node, const std::vector<std::string>& all_urls) {
  const std::vector<std::string> urls = tried_urls(node, all_urls);
  const auto [known, is_new] = image_lists_.try_emplace({folder_of(node).string(), urls}, -1);
  if (!is_new) return known->second;
  std::string reason = "it names no file";
  for (const std::string& url : urls) {
    const auto image = images_.open(folder_of(node), url);
    if (image) return known->second = *image;
    reason = image.reason();
  }
  warn(node, "the texture cannot be read (" + reason + "); tried " + quoted_list(urls));
  return -1;
}

int Reading::pixel_texture(const Node& node, const std::vector<double>& image) {
  const auto [known, is_new] = pixel_textures_.try_emplace(image.data(), -1);
  if (!is_new) return known->second;
  if (image.size() < 3 || image[0] < 1 || image[1] < 1) return -1;  // 0 0 0 means: no texture
  const double count = std::floor(image[0]) * std::floor(image[1]);
  if (image[2] < 1 || image[2] > 4 || count > static_cast<double>(image.size() - 3) ||
      count > static_cast<double>(images_.pixels_left())) {
    warn(node,
         "the texture of pixels cannot be read: it must have width, height, 1 to 4 channels, and as many "
         "pixels");
    return -1;
  }
  Texture texture;
  texture.width = static_cast<int>(image[0]);
  texture.height = static_cast<int>(image[1]);
  texture.channels = static_cast<int>(image[2]);
  texture.name = at(node);
  for (std::size_t i = 3; i < 3 + static_cast<std::size_t>(count); ++i) {
    const double value = std::clamp(image[i], 0., 4294967295.);
    const auto pixel = static_cast<std::uint32_t>(value);
    const auto channel = [&](int c) { return ((pixel >> (8 * (texture.channels - 1 - c))) & 255u) / 255.; };
    const bool is_gray = texture.channels < 3;
    texture.luminance.push_back(
        luminance_of_srgb(channel(0), channel(is_gray ? 0 : 1), channel(is_gray ? 0 : 2)));
    if (texture.channels % 2 == 0)
      texture.opacity.push_back(static_cast<float>(channel(texture.channels - 1)));
  }
  return known->second = images_.add(std::move(texture));
}

namespace {

/// What a search through the node's fields may visit.
std::size_t search_items(const Node& node) {
  std::size_t items = 1 + node.fields.size() + node.children.size();
  for (const Field& field : node.fields)
    for (const std::string& text : field.value.strings) items += 1 + text.size() / kTextItem;
  return items;
}

}  // namespace

Reference Reading::resolve(Reference reference) {
  for (int links = 0; reference; ++links) {
    const Node& node = *reference.node;
    if (++node_count_ > limits_.nodes)
      throw InputError(at(node),
                       "with USE, PROTO and Inline expanded the model has more nodes than the limit of " +
                           std::to_string(limits_.nodes));
    if (links > limits_.depth)
      throw InputError(at(node), "PROTOs that stand for each other are nested more than " +
                                     std::to_string(limits_.depth) + " deep");
    // A field of a PROTO's body may be one of the instance, and so on outwards.
    spend(search_items(node) + (reference.frame ? reference.frame->search_items : 0), node);
    if (!node.prototype) return reference;
    if (!node.prototype->body) {
      ignore(node);
      return {};
    }
    const std::size_t outer_items = reference.frame ? reference.frame->search_items : 0;
    const std::size_t items = search_items(node) + node.prototype->defaults.size();
    frames_.push_back({&node, reference.frame, outer_items + items});
    reference = {node.prototype->body.get(), &frames_.back()};
  }
  return reference;
}

void Reading::spend(std::size_t items, const Node& node) {
  work_ += items;
  if (work_ > kBaseWork + kWorkPerTriangle * limits_.triangles)
    throw InputError(at(node),
                     "with USE, PROTO and Inline expanded the model has more geometry than the limit allows");
}

void Reading::ignore(const Node& node) {
  if (is_scenery(node.type)) return;
  // A hostile file may make up any number of types; the first few say enough.
  if (ignored_.size() > kWarningLimit && !ignored_.count(node.type)) return;
  Ignored& entry = ignored_[node.type];
  if (entry.count++ == 0) entry.first_at = at(node);
}

std::string Reading::no_surface_sentence() const {
  std::string sentence = "there is no surface to paint";
  std::string types;
  for (const auto& [type, entry] : ignored_)
    types += (types.empty() ? "" : ", ") + std::to_string(entry.count) + " " + type.substr(0, 60) +
             (is_bare_geometry(type) ? " (without a Shape around it)" : "");
  if (missing_inline_count_ > 0)
    sentence += "; " + std::to_string(missing_inline_count_) +
                " inlined files cannot be read (the first: " + first_missing_inline_ + ")";
  if (!types.empty()) sentence += "; nodes that make no surface or are not known: " + types;
  return sentence;
}

TexturedMesh Reading::finish(const std::string& name) {
  if (builder.mesh().triangles.empty()) throw InputError(name, no_surface_sentence());
  for (const auto& [type, entry] : ignored_)
    if (warnings.size() < kWarningLimit)
      warnings.push_back(entry.first_at + ": " + type.substr(0, 80) + " is left out (" +
                         std::to_string(entry.count) + (entry.count == 1 ? " node)" : " nodes)"));
  return builder.finish(warnings);
}

void walk(Reading& reading, const Scene& scene, const Context& context) {
  if (scene.version == 1)
    walk_vrml1(reading, scene, context);
  else
    walk_vrml2(reading, scene, context);
}

Context deeper(const Reading& reading, const Context& context, const Node& node) {
  if (context.depth >= reading.limits().depth)
    throw InputError(at(node), "with PROTO and Inline expanded, nodes are nested more than " +
                                   std::to_string(reading.limits().depth) + " deep");
  Context inner = context;
  ++inner.depth;
  return inner;
}

void walk_inline(Reading& reading, const Node& node, const std::vector<std::string>& urls,
                 const Context& context) {
  const Scene* scene = reading.open_inline(node, urls);
  if (!scene) return;
  if (std::find(context.files.begin(), context.files.end(), scene) != context.files.end()) {
    reading.warn(node, "the inlined file contains itself; this one is left out");
    return;
  }
  Context inside = deeper(reading, context, node);
  inside.files.push_back(scene);
  walk(reading, *scene, inside);
}

Eigen::Affine3d transform_of(const Reference& node, const char* scale_field) {
  using Eigen::Matrix3d;
  using Eigen::Translation3d;
  using Eigen::Vector3d;
  using Eigen::Vector4d;
  const Vector3d center = vector3_of(node, "center", Vector3d::Zero());
  const Vector3d scale = vector3_of(node, scale_field, Vector3d::Ones());
  const Vector3d translation = vector3_of(node, "translation", Vector3d::Zero());
  const Matrix3d rotation = rotation_matrix(rotation_of(node, "rotation", Vector4d(0, 0, 1, 0)));
  const Matrix3d oriented = rotation_matrix(rotation_of(node, "scaleOrientation", Vector4d(0, 0, 1, 0)));
  const Matrix3d linear = rotation * oriented * scale.asDiagonal() * oriented.transpose();
  Eigen::Affine3d X;
  X.linear() = linear;
  X.translation() = translation + center - linear * center;
  return X;
}

}  // namespace hilbrush::vrml
