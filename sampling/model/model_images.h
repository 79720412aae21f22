#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>

#include "sampling/base/result.h"
#include "sampling/model/files/face_list.h"
#include "sampling/model/model_file.h"
#include "sampling/model/model_folder.h"

namespace hilbrush {

/// The image files of one model. Each file is read once, whatever it is called and whether it can be read or
/// not, and searches for files are counted: a small model may name any number of them.
class ModelImages {
 public:
  ModelImages(ModelFolder& folder, const ImageReader& read_image, const ModelLimits& limits,
              MeshBuilder& builder)
      : folder_(folder), read_image_(read_image), builder_(builder), pixels_left_(limits.image_pixels) {}

  /// Index in the builder of the texture that `url`, written in a file of folder `base`, means; or why there
  /// is none.
  Result<int> open(const std::filesystem::path& base, const std::string& url);

  /// The same for a file that is not an image (an inlined model): only the search is counted.
  Result<std::filesystem::path> find(const std::filesystem::path& base, const std::string& url);

  /// Adds a texture that was made from the model itself. @pre it has at most pixels_left() texels
  int add(Texture texture);

  std::size_t pixels_left() const { return pixels_left_; }

 private:
  ModelFolder& folder_;
  const ImageReader& read_image_;
  MeshBuilder& builder_;
  std::size_t pixels_left_;
  std::size_t search_count_ = 0;
  std::map<std::string, Result<int>> images_;  ///< by file
};

}  // namespace hilbrush
