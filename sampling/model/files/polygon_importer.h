#pragma once
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/Mesh/BaseKernel.hh>

#include "sampling/model/files/face_list.h"

/// Only for the readers of mesh formats: OpenMesh's headers are heavy.
namespace hilbrush {

/// Takes what OpenMesh's file readers deliver as plain polygons. No connectivity is built, so nothing is split, dropped
/// or left uninitialized. Every face gets a valid handle, because the readers attach the data of later faces to the
/// wrong ones after a refused face.
class PolygonImporter : public OpenMesh::IO::BaseImporter {
 public:
  using FaceHandle = OpenMesh::FaceHandle;
  using VertexHandle = OpenMesh::VertexHandle;
  using HalfedgeHandle = OpenMesh::HalfedgeHandle;
  using EdgeHandle = OpenMesh::EdgeHandle;

  /// @throws InputError at `name` from the callbacks once a limit is exceeded.
  PolygonImporter(std::string name, const ModelLimits& limits) : name_(std::move(name)), limits_(limits) {}

  struct Polygons {
    FaceList faces;
    std::size_t dropped = 0;  ///< faces with corners that do not exist; they are not in `faces`
  };
  /// Hands over what was read. `luminance_otherwise` is for what has no color. Vertex colors go before face colors.
  Polygons take_polygons(float luminance_otherwise);

  /// A face property that the file brought along, by name; null if there is none of that name and type.
  template <class T>
  const T* face_property(const char* property, std::size_t face) {
    OpenMesh::FPropHandleT<T> handle;
    if (!store_.get_property_handle(handle, property)) return nullptr;
    return &store_.property(handle, FaceHandle(static_cast<int>(face)));
  }
  /// Corners of a face as delivered.
  std::size_t corner_count(std::size_t face) const { return face_ends_[face] - (face ? face_ends_[face - 1] : 0); }
  /// Sets texture coordinates of a face's corners; as many pairs as it has corners.
  void set_face_uv(std::size_t face, const std::vector<float>& numbers);

  // What the readers call.
  VertexHandle add_vertex(const OpenMesh::Vec3f& p) override;
  VertexHandle add_vertex(const OpenMesh::Vec3d& p) override;
  VertexHandle add_vertex() override { return add_vertex(OpenMesh::Vec3f(0, 0, 0)); }
  void set_point(VertexHandle v, const OpenMesh::Vec3f& p) override;
  FaceHandle add_face(const VHandles& corners) override;
  void add_face_texcoords(FaceHandle f, VertexHandle first, const std::vector<OpenMesh::Vec2f>& uv) override;
  void set_texcoord(VertexHandle v, const OpenMesh::Vec2f& uv) override;
  void set_color(VertexHandle v, const OpenMesh::Vec3uc& c) override {
    set_vertex_color(v, c[0] / 255., c[1] / 255., c[2] / 255.);
  }
  void set_color(VertexHandle v, const OpenMesh::Vec4uc& c) override {
    set_vertex_color(v, c[0] / 255., c[1] / 255., c[2] / 255.);
  }
  void set_color(VertexHandle v, const OpenMesh::Vec3f& c) override { set_vertex_color(v, c[0], c[1], c[2]); }
  void set_color(VertexHandle v, const OpenMesh::Vec4f& c) override { set_vertex_color(v, c[0], c[1], c[2]); }
  void set_color(FaceHandle f, const OpenMesh::Vec3uc& c) override {
    set_face_color(f, c[0] / 255., c[1] / 255., c[2] / 255.);
  }
  void set_color(FaceHandle f, const OpenMesh::Vec4uc& c) override {
    set_face_color(f, c[0] / 255., c[1] / 255., c[2] / 255.);
  }
  void set_color(FaceHandle f, const OpenMesh::Vec3f& c) override { set_face_color(f, c[0], c[1], c[2]); }
  void set_color(FaceHandle f, const OpenMesh::Vec4f& c) override { set_face_color(f, c[0], c[1], c[2]); }
  size_t n_vertices() const override { return points_.size(); }
  size_t n_faces() const override { return face_ends_.size(); }
  size_t n_edges() const override { return 0; }
  OpenMesh::BaseKernel* kernel() override { return &store_; }

  // Not for polygons.
  HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
  FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f>&) override {}
  void set_face_texindex(FaceHandle, int) override {}
  void set_halfedge(VertexHandle, HalfedgeHandle) override {}
  void set_normal(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(VertexHandle, const OpenMesh::Vec3d&) override {}
  void set_normal(FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(FaceHandle, const OpenMesh::Vec3d&) override {}
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec2f&) override {}
  void set_texcoord(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec3f&) override {}
  void set_status(VertexHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_status(HalfedgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_status(EdgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_status(FaceHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_next(HalfedgeHandle, HalfedgeHandle) override {}
  void set_face(HalfedgeHandle, FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void set_color(EdgeHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(EdgeHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(EdgeHandle, const OpenMesh::Vec3f&) override {}
  void set_color(EdgeHandle, const OpenMesh::Vec4f&) override {}
  void add_texture_information(int, std::string) override {}

 private:
  /// Where the PLY reader puts properties it does not know.
  class Store : public OpenMesh::BaseKernel {
   public:
    size_t n_vertices() const override { return vertex_count; }
    size_t n_faces() const override { return face_count; }
    void grow_faces(std::size_t count) {
      face_count = count;
      fprops_resize(count);
    }
    void grow_vertices(std::size_t count) {
      vertex_count = count;
      vprops_resize(count);
    }
    std::size_t vertex_count = 0;
    std::size_t face_count = 0;
  };

  void set_vertex_color(VertexHandle v, double red, double green, double blue);
  void set_face_color(FaceHandle f, double red, double green, double blue);

  std::string name_;
  const ModelLimits& limits_;
  Store store_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Eigen::Vector2d> vertex_uv_, corner_uv_;
  std::vector<float> vertex_luminance_, face_luminance_;  // negative: none given
  std::vector<std::uint32_t> corners_;
  std::vector<std::size_t> face_ends_;
};

}  // namespace hilbrush
