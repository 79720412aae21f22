#pragma once
#include <string>

#include "sampling/model/model_file.h"
#include "sampling/model/model_folder.h"

/// The mesh formats. Their readers fill a list of polygons, in double precision, so that faces which do not
/// fit together as a manifold arrive as they are and mesh_repair reports what it does about them. No count of
/// a file is believed.
namespace hilbrush {

/// OBJ with its MTL: one texture or color a material, colors a vertex. `text` is the whole file, `name` what
/// messages call it.
/// @throws InputError "name:line" or "name" if nothing usable is in it or a limit is exceeded; so do the
/// others.
Model load_obj(std::string text, const std::string& name, ModelFolder& folder, const ImageReader& read_image,
               const ModelLimits& limits);

/// PLY, ASCII and binary: texture coordinates a vertex (u v, s t, texture_u texture_v) or a face corner (a
/// list named texcoord), the image of "comment TextureFile", colors a vertex or a face.
Model load_ply(std::string text, const std::string& name, ModelFolder& folder, const ImageReader& read_image,
               const ModelLimits& limits);

/// OFF, ASCII: colors a vertex or a face.
Model load_off(std::string text, const std::string& name, const ModelLimits& limits);

/// STL, ASCII and binary.
Model load_stl(std::string text, const std::string& name, const ModelLimits& limits);

}  // namespace hilbrush
