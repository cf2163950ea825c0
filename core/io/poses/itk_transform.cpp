#include "core/io/poses/itk_transform.h"

#include "core/io/files/one_eigen.h"

#include <itkCenteredAffineTransform.h>
#include <itkCenteredEuler3DTransform.h>
#include <itkComposeScaleSkewVersor3DTransform.h>
#include <itkFixedCenterOfRotationAffineTransform.h>
#include <itkIdentityTransform.h>
#include <itkQuaternionRigidTransform.h>
#include <itkScaleLogarithmicTransform.h>
#include <itkScaleSkewVersor3DTransform.h>
#include <itkScaleVersor3DTransform.h>
#include <itkSimilarity3DTransform.h>
#include <itkTranslationTransform.h>

#include <algorithm>
#include <array>

#include "core/base/error.h"
#include "core/io/images/quiet_itk.h"

namespace raylign::detail {
namespace {

using ItkTransform = itk::Transform<double, 3, 3>;

template <typename T>
ItkTransform::Pointer made() {
    return T::New().GetPointer();
}

struct KnownTransform {
    std::string_view name;
    ItkTransform::Pointer (*make)();
};

/// Those that can be rigid. (ITK does not make MatrixOffsetTransformBase by its name.)
constexpr std::array<KnownTransform, 19> kKnownTransforms = {{
    {"AffineTransform", &made<itk::AffineTransform<double, 3>>},
    {"CenteredAffineTransform", &made<itk::CenteredAffineTransform<double, 3>>},
    {"CenteredEuler3DTransform", &made<itk::CenteredEuler3DTransform<double>>},
    {"ComposeScaleSkewVersor3DTransform", &made<itk::ComposeScaleSkewVersor3DTransform<double>>},
    {"Euler3DTransform", &made<itk::Euler3DTransform<double>>},
    {"FixedCenterOfRotationAffineTransform", &made<itk::FixedCenterOfRotationAffineTransform<double, 3>>},
    {"IdentityTransform", &made<itk::IdentityTransform<double, 3>>},
    {"MatrixOffsetTransformBase", &made<itk::MatrixOffsetTransformBase<double, 3, 3>>},
    {"QuaternionRigidTransform", &made<itk::QuaternionRigidTransform<double>>},
    {"Rigid3DTransform", &made<itk::Rigid3DTransform<double>>},
    {"ScalableAffineTransform", &made<itk::ScalableAffineTransform<double, 3>>},
    {"ScaleLogarithmicTransform", &made<itk::ScaleLogarithmicTransform<double, 3>>},
    {"ScaleSkewVersor3DTransform", &made<itk::ScaleSkewVersor3DTransform<double>>},
    {"ScaleTransform", &made<itk::ScaleTransform<double, 3>>},
    {"ScaleVersor3DTransform", &made<itk::ScaleVersor3DTransform<double>>},
    {"Similarity3DTransform", &made<itk::Similarity3DTransform<double>>},
    {"TranslationTransform", &made<itk::TranslationTransform<double, 3>>},
    {"VersorRigid3DTransform", &made<itk::VersorRigid3DTransform<double>>},
    {"VersorTransform", &made<itk::VersorTransform<double>>},
}};

constexpr std::string_view kComposite = "CompositeTransform";

/// "Euler3DTransform" of "Euler3DTransform_double_3_3"; "" where it is not of three dimensions.
std::string_view plain_type(std::string_view type) {
    for (const std::string_view ending : {"_double_3_3", "_float_3_3"}) {
        if (type.ends_with(ending)) return type.substr(0, type.size() - ending.size());
    }
    return {};
}

ItkTransform::Pointer make_transform(const std::string& type, const std::string& where) {
    const std::string_view name = plain_type(type);
    const auto found = std::ranges::find(kKnownTransforms, name, &KnownTransform::name);
    if (found != kKnownTransforms.end()) return found->make();
    throw bad_value("transform type", type,
                    "a rigid one in 3-D: Euler3DTransform, VersorRigid3DTransform, AffineTransform, "
                    "TranslationTransform or alike, or a CompositeTransform of them",
                    where);
}

Eigen::Matrix4d matrix_of(const ItkTransform& transform) {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    if (const auto* shift = dynamic_cast<const itk::TranslationTransform<double, 3>*>(&transform)) {
        for (unsigned r = 0; r < 3; ++r) matrix(r, 3) = shift->GetOffset()[r];
    } else if (const auto* affine = dynamic_cast<const itk::MatrixOffsetTransformBase<double, 3, 3>*>(&transform)) {
        for (unsigned r = 0; r < 3; ++r) {
            for (unsigned c = 0; c < 3; ++c) matrix(r, c) = affine->GetMatrix()(r, c);
            matrix(r, 3) = affine->GetOffset()[r];
        }
    }
    return matrix;  // left over is the identity
}

ItkTransform::ParametersType itk_parameters(const std::vector<double>& numbers) {
    ItkTransform::ParametersType parameters(numbers.size());
    std::ranges::copy(numbers, parameters.begin());
    return parameters;
}

/// The centre of rotation, and of Euler angles their order. Older files leave out a centre at the origin.
void set_fixed_parameters(const StoredTransform& stored, ItkTransform& transform, const std::string& where) {
    const bool has_centre = dynamic_cast<const itk::MatrixOffsetTransformBase<double, 3, 3>*>(&transform) != nullptr;
    const std::size_t count = stored.fixed_parameters.size();
    if (!has_centre || count == 0) return;
    if (count != 3 && count != 4) {
        throw bad_value("number of fixed parameters of " + stored.type, std::to_string(count), "3, the centre", where);
    }
    ItkTransform::FixedParametersType parameters(count);
    std::ranges::copy(stored.fixed_parameters, parameters.begin());
    transform.SetFixedParameters(parameters);
}

RigidTransform rigid_from(const StoredTransform& stored, const std::string& where) {
    const ItkTransform::Pointer transform = make_transform(stored.type, where);
    if (stored.parameters.size() != transform->GetNumberOfParameters()) {
        throw bad_value("number of parameters of " + stored.type, std::to_string(stored.parameters.size()),
                        std::to_string(transform->GetNumberOfParameters()), where);
    }
    set_fixed_parameters(stored, *transform, where);
    try {
        transform->SetParametersByValue(itk_parameters(stored.parameters));
    } catch (const itk::ExceptionObject& failure) {
        throw Error(stored.type + " in " + where + ": " + reason_of(failure));
    }
    return rigid_from_matrix(matrix_of(*transform), where);
}

}  // namespace

RigidTransform rigid_from_transforms(const std::vector<StoredTransform>& transforms, const std::string& where) {
    const bool is_composite = !transforms.empty() && plain_type(transforms.front().type) == kComposite;
    const std::size_t first = is_composite ? 1 : 0;
    if (transforms.size() == first) throw Error(where + " has no transform: must have at least one");
    if (transforms.size() == first + 1) return rigid_from(transforms[first], where);
    RigidTransform product;
    for (std::size_t i = first; i < transforms.size(); ++i) {
        const std::string place = where + ", transform " + std::to_string(i + 1 - first);
        if (plain_type(transforms[i].type) == kComposite) {
            throw Error(place + " is a CompositeTransform within the file: its parts must stand by themselves");
        }
        product = product * rigid_from(transforms[i], place);
    }
    return product;
}

}  // namespace raylign::detail
