#include "core/base/names.h"
#include "raylign/backends.h"

namespace raylign {
using namespace detail;
namespace {

constexpr Names<Storage, 2> kStorages{{{Storage::float32, "float32"}, {Storage::int16, "int16"}}};
constexpr Names<InstructionSet, 4> kInstructionSets{{{InstructionSet::sse2, "sse2"},
                                                     {InstructionSet::avx2, "avx2"},
                                                     {InstructionSet::avx512, "avx512"},
                                                     {InstructionSet::neon, "neon"}}};
constexpr Names<Interpolation, 2> kInterpolations{
    {{Interpolation::hardware, "hardware"}, {Interpolation::exact, "exact"}}};
constexpr Names<Solver, 2> kSolvers{{{Solver::host, "host"}, {Solver::device, "device"}}};

}  // namespace

std::string_view storage_name(Storage storage) { return name_in(kStorages, storage); }
std::string_view instruction_set_name(InstructionSet set) { return name_in(kInstructionSets, set); }
std::string_view interpolation_name(Interpolation value) { return name_in(kInterpolations, value); }
std::string_view solver_name(Solver solver) { return name_in(kSolvers, solver); }
Storage storage_from_name(std::string_view name) { return value_in(kStorages, "storage", name); }
InstructionSet instruction_set_from_name(std::string_view name) {
    return value_in(kInstructionSets, "instruction set", name);
}
Interpolation interpolation_from_name(std::string_view name) {
    return value_in(kInterpolations, "interpolation", name);
}

Solver solver_from_name(std::string_view name) { return value_in(kSolvers, "solver", name); }

}  // namespace raylign
