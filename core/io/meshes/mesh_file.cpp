#include "core/io/meshes/mesh_file.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <span>

#include "core/base/error.h"
#include "core/io/decode/decoder.h"
#include "core/io/decode/pack.h"
#include "core/io/files/file_format.h"
#include "core/io/files/text.h"

namespace raylign::detail {
namespace {

TriangleMesh mesh_of(const aiScene& scene) {
    TriangleMesh mesh;
    for (const aiMesh* part : std::span(scene.mMeshes, scene.mNumMeshes)) {
        const auto first = static_cast<std::int32_t>(mesh.vertices_mm.size());
        for (const aiVector3D& v : std::span(part->mVertices, part->mNumVertices)) {
            mesh.vertices_mm.emplace_back(v.x, v.y, v.z);
        }
        for (const aiFace& face : std::span(part->mFaces, part->mNumFaces)) {
            if (face.mNumIndices != 3) continue;  // points and lines
            const auto corner = [&](unsigned int k) {
                if (face.mIndices[k] >= part->mNumVertices) throw Error("a triangle names a vertex that there is not");
                return first + static_cast<std::int32_t>(face.mIndices[k]);
            };
            mesh.triangles.push_back({corner(0), corner(1), corner(2)});
        }
    }
    return mesh;
}

TriangleMesh read_mesh_here(const std::filesystem::path& path) {
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(path.string(), aiProcess_Triangulate);
    if (scene == nullptr) throw Error(path.string() + " cannot be read as a mesh: " + importer.GetErrorString());
    return mesh_of(*scene);
}

void decode_mesh(const std::filesystem::path& path, const std::string&, DecoderReply& reply) {
    const TriangleMesh mesh = read_mesh_here(path);
    reply.message(Packer().add(mesh.vertices_mm.size()).add(mesh.triangles.size()).bytes());
    reply.bulk(std::as_bytes(std::span(mesh.vertices_mm)));
    reply.bulk(std::as_bytes(std::span(mesh.triangles)));
}

/// The other process is not trusted.
void check_corners(const TriangleMesh& mesh, const std::filesystem::path& path) {
    const auto count = static_cast<std::int32_t>(mesh.vertices_mm.size());
    for (const TriangleMesh::Triangle& triangle : mesh.triangles) {
        for (const std::int32_t corner : triangle) {
            if (corner < 0 || corner >= count) throw Error(path.string() + ": a triangle without its vertex");
        }
    }
}

}  // namespace

bool is_mesh_file(const std::filesystem::path& path) {
    const std::string extension = lower_case(path.extension().string());
    return extension == ".stl" || extension == ".obj" || extension == ".ply";
}

TriangleMesh read_mesh(const std::filesystem::path& path) {
    check_readable_file(path);
    TriangleMesh mesh;
    const DecodeRequest request{&decode_mesh, path, "", limits_for(path)};
    const bool is_read = decode(request, [&](DecodedStream& stream) {
        constexpr std::size_t kMost = 1U << 28U;  // of triangles, 3.2 GB
        const std::string said = stream.message();
        Unpacker from(said);
        const auto vertices = from.number<std::size_t>(), triangles = from.number<std::size_t>();
        if (vertices > kMost || triangles > kMost) throw Error(path.string() + " has more triangles than can be used");
        mesh.vertices_mm.resize(vertices);
        mesh.triangles.resize(triangles);
        stream.bulk(std::as_writable_bytes(std::span(mesh.vertices_mm)));
        stream.bulk(std::as_writable_bytes(std::span(mesh.triangles)));
    });
    if (!is_read) mesh = read_mesh_here(path);
    check_corners(mesh, path);
    return mesh;
}

}  // namespace raylign::detail
