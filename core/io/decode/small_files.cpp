#include "core/io/decode/small_files.h"

#include <cstdint>

#include "core/io/decode/decoder.h"
#include "core/io/decode/pack.h"

namespace raylign::detail {
namespace {

using PoseReader = RigidTransform (*)(const std::filesystem::path&);
using Trial = void (*)(const std::filesystem::path&);

template <typename Function>
std::string packed_function(Function function) {
    return Packer().add(reinterpret_cast<std::uintptr_t>(function)).bytes();
}

template <typename Function>
Function unpacked_function(const std::string& arguments) {
    return reinterpret_cast<Function>(Unpacker(arguments).number<std::uintptr_t>());
}

void decode_pose(const std::filesystem::path& path, const std::string& arguments, DecoderReply& reply) {
    const RigidTransform pose = unpacked_function<PoseReader>(arguments)(path);
    const Eigen::MatrixXd rotation = pose.rotation, translation_mm = pose.translation_mm;
    reply.message(Packer().add(rotation).add(translation_mm).bytes());
}

void try_decoding(const std::filesystem::path& path, const std::string& arguments, DecoderReply&) {
    unpacked_function<Trial>(arguments)(path);
}

}  // namespace

RigidTransform pose_in_own_process(const std::filesystem::path& path, PoseReader read) {
    RigidTransform pose;
    const DecodeRequest request{&decode_pose, path, packed_function(read), limits_for(path)};
    const bool is_read = decode(request, [&](DecodedStream& stream) {
        const std::string said = stream.message();
        Unpacker from(said);
        Eigen::MatrixXd rotation, translation_mm;
        from.take(rotation);
        from.take(translation_mm);
        if (rotation.size() != 9 || translation_mm.size() != 3) throw Error(path.string() + " gives no pose");
        pose = {rotation, translation_mm};
    });
    return is_read ? pose : read(path);
}

void try_in_own_process(const std::filesystem::path& path, Trial read) {
    const DecodeRequest request{&try_decoding, path, packed_function(read), limits_for(path)};
    (void)decode(request, [](DecodedStream&) {});  // without a process the caller's own reading is the trial
}

}  // namespace raylign::detail
