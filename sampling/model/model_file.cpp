#include "sampling/model/model_file.h"

#include <algorithm>
#include <string_view>

#include "sampling/base/input_error.h"
#include "sampling/model/files/face_list.h"
#include "sampling/model/files/mesh_file.h"
#include "sampling/model/files/text_lines.h"
#include "sampling/model/model_folder.h"
#include "sampling/model/vrml/reading.h"

namespace hilbrush {
namespace {

namespace fs = std::filesystem;

enum class Kind { kVrml, kObj, kPly, kOff, kStl };

bool starts_with(std::string_view text, std::string_view head) {
  return text.substr(0, head.size()) == head;
}

/// OFF's first word may have letters before it for what the vertices have.
bool is_off(std::string_view text) {
  const std::string_view word = text.substr(0, text.find_first_of(" \t\r\n#"));
  return word == "OFF" || word == "COFF" || word == "NOFF" || word == "CNOFF" || word == "STOFF" ||
         word == "STCOFF";
}

/// The message for a kind of model that is known but not read, by its first bytes or ending; else empty.
std::string refusal_of(std::string_view text, const std::string& ending) {
  if (starts_with(text, "glTF") || ending == ".glb" || ending == ".gltf")
    return "this is a glTF model, which is not read; convert it to VRML 2.0, OBJ, PLY, OFF or STL";
  if (starts_with(text, "PK\x03\x04"))
    return "this is a zip archive (3MF, perhaps), which is not read; convert it to VRML 2.0, OBJ, PLY, OFF "
           "or STL";
  if (starts_with(text, "#X3D") || ending == ".x3d" || ending == ".x3dv" || starts_with(text, "<?xml"))
    return "this is an XML or X3D model, which is not read; convert it to VRML 2.0, OBJ, PLY, OFF or STL";
  if (starts_with(text, "#Inventor"))
    return "this is an Open Inventor model, which is not read; convert it to VRML 2.0";
  return "";
}

Kind kind_of(std::string_view text, const fs::path& file, const std::string& name) {
  if (starts_with(text, "\xef\xbb\xbf")) text.remove_prefix(3);
  const std::string ending = lower_case(file.extension().string());
  if (const std::string refusal = refusal_of(text, ending); !refusal.empty()) throw InputError(name, refusal);
  if (text.substr(0, 64).find("VRML V") != text.npos && starts_with(text, "#")) return Kind::kVrml;
  if (starts_with(text, "ply\n") || starts_with(text, "ply\r")) return Kind::kPly;
  if (is_off(text)) return Kind::kOff;
  if (ending == ".wrl" || ending == ".wrz" || ending == ".vrml") return Kind::kVrml;
  if (ending == ".obj") return Kind::kObj;
  if (ending == ".ply") return Kind::kPly;
  if (ending == ".off") return Kind::kOff;
  if (ending == ".stl" || starts_with(text, "solid")) return Kind::kStl;
  throw InputError(
      name,
      "neither its first bytes nor its ending say what kind of model this is; VRML (.wrl), OBJ, PLY, OFF "
      "and STL are read");
}

Model load_vrml(std::string text, const std::string& name, ModelFolder& folder, const ImageReader& read_image,
                const ModelLimits& limits) {
  vrml::Reading reading(folder, read_image, limits);
  const vrml::Scene& scene = reading.parse_text(text, name);
  std::string().swap(text);  // the tree has copies
  vrml::Context origin;
  origin.files.push_back(&scene);
  vrml::walk(reading, scene, origin);
  Model model;
  model.mesh = reading.finish(name);
  model.warnings = std::move(reading.warnings);
  model.unit_m = 1;
  model.up = UpAxis::kY;
  return model;
}

/// A file of a mesh format without any color does not mean a white object: its color is unknown, and it is
/// painted in the gray that viewers show it in. (VRML is explicit: a shape without a material is white.)
void paint_in_default_gray(Model& model, const std::string& name) {
  constexpr double kGray = .8;  // sRGB-encoded, as the default material of VRML has it
  const auto is_silent = [](const Material& material) { return material.source == ColorSource::kNone; };
  if (!std::ranges::all_of(model.mesh.materials, is_silent)) return;
  for (Material& material : model.mesh.materials) material.source = ColorSource::kMaterial;
  const float luminance = luminance_of_srgb(kGray, kGray, kGray);
  for (auto& corners : model.mesh.corner_luminance) corners.fill(luminance);
  model.warnings.push_back(name + ": the file says nothing of color; the object is painted in a light gray");
}

}  // namespace

Model load_model(const fs::path& file, const ImageReader& read_image, const ModelLimits& limits) {
  ModelFolder folder(file, limits.file_bytes);
  const fs::path inside = folder.path() / file.filename();
  const std::string name = file.filename().string();
  std::string text = folder.read(inside);
  if (text.empty()) throw InputError(name, "the file is empty");
  Model model;
  const Kind kind = kind_of(text, file, name);
  switch (kind) {
    case Kind::kVrml:
      model = load_vrml(std::move(text), name, folder, read_image, limits);
      break;
    case Kind::kObj:
      model = load_obj(std::move(text), name, folder, read_image, limits);
      break;
    case Kind::kPly:
      model = load_ply(std::move(text), name, folder, read_image, limits);
      break;
    case Kind::kOff:
      model = load_off(std::move(text), name, limits);
      break;
    case Kind::kStl:
      model = load_stl(std::move(text), name, limits);
      break;
  }
  if (kind != Kind::kVrml) paint_in_default_gray(model, name);
  model.files = folder.files();
  return model;
}

}  // namespace hilbrush
