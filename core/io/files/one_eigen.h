#pragma once

// To be included before ITK's headers: they bring an Eigen of their own, of another version, and two of them in one
// program break the one-definition rule (and do not compile together). Taking the place of itk_eigen.h points ITK to
// ours.
#include <Eigen/Core>

#define itk_eigen_h
#define ITK_EIGEN(header) <Eigen/header>
