#pragma once
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "sampling/model/files/face_list.h"
#include "sampling/model/model_file.h"
#include "sampling/model/model_folder.h"
#include "sampling/model/model_images.h"
#include "sampling/model/vrml/binding.h"
#include "sampling/model/vrml/parser.h"

namespace hilbrush::vrml {

/// The state of reading one model while the walks over its files' trees make the mesh: limits, files, images,
/// the mesh so far.
class Reading {
 public:
  Reading(ModelFolder& folder, const ImageReader& read_image, const ModelLimits& limits)
      : builder(limits), limits_(limits), folder_(folder), images_(folder, read_image, limits, builder) {}
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  /// Parses text that is at hand (the model itself). The result lives as long as this.
  const Scene& parse_text(const std::string& text, const std::string& name);

  /// The first of an Inline's urls that can be read, or null with a warning that names them.
  const Scene* open_inline(const Node& node, const std::vector<std::string>& urls);

  /// Index of the first of the urls that can be read, or -1 with a warning that names them.
  int open_image(const Node& node, const std::vector<std::string>& urls);

  /// Index of the texture that an SFImage makes (width, height, channels, pixels from the lower left), or -1
  /// with a warning.
  int pixel_texture(const Node& node, const std::vector<double>& image);

  /// Follows a PROTO instance to the node it stands for, to be walked; null if it has none. Every call counts
  /// as a node.
  /// @throws InputError if the limit of nodes is exceeded.
  Reference resolve(Reference reference);

  /// Counts work that grows with what a node holds, so that many USEs of a large node reach a limit: numbers
  /// that geometry and colors are made from, fields that are searched, names that are compared.
  /// @throws InputError.
  void spend(std::size_t items, const Node& node);

  /// Notes a node that makes no surface; the first line of each type is reported.
  void ignore(const Node& node);

  void warn(const Node& node, const std::string& sentence);
  /// Adds warnings that name their file and line themselves; equal ones are added once.
  void warn(const std::vector<std::string>& sentences);

  /// Ends the reading: notes on what was ignored, then all warnings. @throws InputError at `name` if no
  /// surface was found.
  TexturedMesh finish(const std::string& name);

  const ModelLimits& limits() const { return limits_; }

  MeshBuilder builder;
  std::vector<std::string> warnings;

 private:
  std::filesystem::path folder_of(const Node& node) const;
  /// The first few of a list of urls: what is tried, and counted.
  std::vector<std::string> tried_urls(const Node& node, const std::vector<std::string>& all);
  std::string no_surface_sentence() const;

  struct Ignored {
    std::size_t count = 0;
    std::string first_at;
  };

  const ModelLimits& limits_;
  ModelFolder& folder_;
  ModelImages images_;
  ParseBudget parse_budget_;
  std::size_t node_count_ = 0;
  std::size_t work_ = 0;  ///< see spend()
  std::size_t missing_inline_count_ = 0;
  std::string first_missing_inline_;
  std::deque<Frame> frames_;
  std::map<std::string, std::unique_ptr<Scene>> scenes_;                         // by file
  std::map<std::pair<std::string, std::vector<std::string>>, int> image_lists_;  // by folder and urls
  std::map<std::pair<std::string, std::vector<std::string>>, const Scene*> inline_lists_;
  std::map<const double*, int> pixel_textures_;
  std::map<std::string, Ignored> ignored_;
  std::set<std::string> said_;  ///< warnings
};

/// Around a node of the walk: the transforms and files that it stands in.
struct Context {
  Eigen::Affine3d X = Eigen::Affine3d::Identity();  ///< from the node's frame to the model's
  int depth = 0;
  std::vector<const Scene*> files;  ///< being walked; one that contains itself is skipped
};

/// Adds all shapes of a VRML 2.0 or 1.0 tree to the reading's mesh.
void walk(Reading& reading, const Scene& scene, const Context& context);
void walk_vrml2(Reading& reading, const Scene& scene, const Context& context);
void walk_vrml1(Reading& reading, const Scene& scene, const Context& context);

/// One level deeper. @throws InputError at `node` if that exceeds the limit.
Context deeper(const Reading& reading, const Context& context, const Node& node);

/// The Inline or WWWInline `node`: its file's shapes, in `context`.
void walk_inline(Reading& reading, const Node& node, const std::vector<std::string>& urls,
                 const Context& context);

/// Matrix of a Transform node, of either version (VRML97, 6.52).
Eigen::Affine3d transform_of(const Reference& node, const char* scale_field);

}  // namespace hilbrush::vrml
