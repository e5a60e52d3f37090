//! From an image to a tilt: the tables of a camera, made once, and the scratch of a thread, grown once.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::confidence::{self, SECTORS};
use super::correction::{Correction, VanishingPoint, closed_form_gains};
use super::estimate::{EdgeElement, TiltEstimate};
use super::image_space::{Offsets, edge_offset, offsets};
use super::options::{Method, TiltOptions};
use super::refine::{Sparse, refine};
use super::vector_consensus::vector_consensus;
use crate::camera::Camera;
use crate::edges::{Detector, EdgeOptions, EdgePixels, LiftTable, NormalKind, Region, Screen};
use crate::error::{Error, Result};
use crate::geometry::{Tilt, tangent_basis};
use crate::image::ImageView;
use crate::robust::{FitReport, Gate, RansacOptions, RejectRefitOptions, Rows, Stop, ransac, reject_refit};

/// Change of the shift in pixels below which the paper's trimming has converged (section 2.1.4).
const SHIFT_TOLERANCE_PX: f64 = 0.1;

/// Most trimming rounds, `N_E` in the paper.
const TRIMMING_ROUNDS: u32 = 15;

/// How far in radians the edges of vertical things stray from the vertical, for the covariance of the paper's methods.
const STRAY_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Estimates the tilt of a robot from single images of one camera.
///
/// Everything that depends only on the camera is computed here once; [`estimate`](Self::estimate) borrows it, so one
/// estimator serves many threads, each with a [`Scratch`] of its own.
#[derive(Debug, Clone)]
pub struct TiltEstimator {
    camera: Camera,
    robot_from_camera: Matrix3<f64>,
    options: TiltOptions,
    region: Region,
    screen: Screen,
    sectors: Vec<u8>,
    centre: Option<VanishingPoint>,
    tables: Tables,
}

/// What the methods look up for each pixel of the region.
#[derive(Debug, Clone)]
enum Tables {
    /// Relative closed-form gains (none for a trained factor), and the factor `a` in pixels per radian.
    Offsets { gains: Vec<f32>, factor: f64, offset_max_px: f64 },
    /// Maps from gradients to normals.
    Normals(LiftTable),
}

/// The memory that one thread works in; estimates after the first allocate nothing.
#[derive(Debug, Clone)]
pub struct Scratch {
    detector: Detector,
    /// What the memory and the detector were made for.
    made_for: Extent,
    edges: EdgePixels,
    rows: Rows<f32>,
    weights: Vec<f32>,
    sparse: Sparse<f32>,
    /// Place of each row among the edge pixels.
    places: Vec<u32>,
    inliers: Inliers,
}

/// What an estimator's scratch depends on.
#[derive(Debug, Clone, PartialEq)]
struct Extent {
    pixels: usize,
    columns: std::ops::Range<usize>,
    edges: EdgeOptions,
}

/// What tells the inliers of the last image.
#[derive(Debug, Clone, Copy)]
enum Inliers {
    /// There was no fit.
    None,
    /// The rows with a weight above zero.
    Weighted,
    /// The rows with a residual of at most the threshold.
    Within { model: [f64; 3], threshold: f64 },
}

impl Inliers {
    fn weighted_if(found: bool) -> Self {
        if found { Self::Weighted } else { Self::None }
    }
}

/// A fit in the parameters of its rows, on the way to an estimate.
struct Fit {
    tilt: Option<Tilt>,
    /// Row model and gate for the covariance.
    model: [f64; 3],
    gate: Gate,
    /// From the row model's first two parameters to the horizontal part of the normal.
    horizontal: Matrix2<f64>,
    inliers: usize,
    shift_px: Option<f64>,
    rms: f64,
    iterations: u32,
    stop: Stop,
}

impl TiltEstimator {
    /// Makes the tables. `robot_from_camera` is `R`, which takes bearings of the camera frame to the robot frame.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] or [`Error::InvalidArgument`] if an option is out of its domain, `R` is no rotation, the mask
    /// does not fit the camera, no pixel sees the elevation band, or the image-space methods cannot see the vertical.
    pub fn new(camera: Camera, robot_from_camera: Matrix3<f64>, options: TiltOptions) -> Result<Self> {
        options.validate()?;
        validate_rotation(&robot_from_camera)?;
        let region = Region::new(&camera, &robot_from_camera, &options.edges, options.mask.as_ref())?;
        let centre = VanishingPoint::new(&camera, &robot_from_camera);
        let tables = match &options.method {
            Method::ImageSpaceRansac { correction, offset_max_px, .. }
            | Method::ImageSpaceRejectRefit { correction, offset_max_px, .. } => {
                let Some(centre) = &centre else {
                    return Err(Error::option(
                        "method",
                        options.method.name(),
                        "a camera that can see the zenith or the nadir; use \"refined\" for others",
                    ));
                };
                let (gains, factor) = match *correction {
                    Correction::None => (Vec::new(), centre.scale),
                    Correction::Factor(factor) => (Vec::new(), factor),
                    Correction::ClosedForm => closed_form_gains(&camera, &robot_from_camera, &region, centre),
                };
                let offset_max_px = options.tilt_max_rad.map_or(*offset_max_px, |tilt| tilt * factor);
                if offset_max_px / factor >= FRAC_PI_2 {
                    return Err(Error::option(
                        "correction",
                        factor,
                        "a factor with which the largest offset is a lean below pi/2; the raw shift is shift_px of the estimate",
                    ));
                }
                Tables::Offsets { gains, factor, offset_max_px }
            }
            Method::VectorConsensus { normal, .. } => {
                Tables::Normals(LiftTable::new(&camera, &robot_from_camera, &region, *normal))
            }
            Method::Refined(_) => {
                Tables::Normals(LiftTable::new(&camera, &robot_from_camera, &region, NormalKind::Tangent))
            }
        };
        let sector = |bearing: Vector3<f64>| -> u8 {
            let turn = bearing.y.atan2(bearing.x) / std::f64::consts::TAU + 0.5;
            ((turn * SECTORS as f64) as usize).min(SECTORS - 1) as u8
        };
        let sectors = region.pixels().map(|(_, _, bearing)| sector(bearing)).collect();
        let screen = match (&tables, &centre) {
            (Tables::Offsets { offset_max_px, .. }, Some(centre)) => {
                Screen::of_offsets(&region, (centre.pixel.x, centre.pixel.y), *offset_max_px)
            }
            (Tables::Normals(table), _) => table.screen(options.normal_tilt_max_rad().sin()),
            (Tables::Offsets { .. }, None) => Screen::of_offsets(&region, (0.0, 0.0), f64::INFINITY),
        };
        Ok(Self { camera, robot_from_camera, options, region, screen, sectors, centre, tables })
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The rotation from the camera frame to the robot frame.
    pub fn robot_from_camera(&self) -> &Matrix3<f64> {
        &self.robot_from_camera
    }

    /// The options.
    pub fn options(&self) -> &TiltOptions {
        &self.options
    }

    /// How many pixels are looked at.
    pub fn region_pixels(&self) -> usize {
        self.region.len()
    }

    /// Memory for one thread, with room for an image in which every pixel is an edge.
    pub fn scratch(&self) -> Scratch {
        let n = self.region.len();
        Scratch {
            detector: Detector::new(&self.region, &self.options.edges),
            made_for: self.extent(),
            edges: EdgePixels::with_capacity(n),
            rows: Rows::with_capacity(n),
            weights: Vec::with_capacity(n),
            sparse: Sparse::with_capacity(n),
            places: Vec::with_capacity(n),
            inliers: Inliers::None,
        }
    }

    fn extent(&self) -> Extent {
        Extent { pixels: self.region.len(), columns: self.region.columns(), edges: self.options.edges }
    }

    /// The tilt of one image. An image without enough edges has an estimate without a tilt, not an error.
    ///
    /// # Errors
    /// [`Error::InvalidArgument`] if the image has another size than the camera's, or the scratch is that of an estimator
    /// with another camera or other edge options.
    pub fn estimate(&self, image: &ImageView<'_>, scratch: &mut Scratch) -> Result<TiltEstimate> {
        let (width, height) = (self.camera.width() as usize, self.camera.height() as usize);
        if (image.width(), image.height()) != (width, height) {
            return Err(Error::argument(
                "image",
                format!("{} x {} pixels", image.height(), image.width()),
                format!("{height} x {width} (rows x columns), as the camera's images"),
            ));
        }
        if scratch.made_for != self.extent() {
            return Err(Error::argument("scratch", "that of another estimator", "one made by this estimator"));
        }
        scratch.detector.detect(image, &self.region, Some(&self.screen), &mut scratch.edges);
        let fit = match &self.tables {
            Tables::Offsets { gains, factor, offset_max_px } => {
                self.fit_offsets(gains, *factor, *offset_max_px, scratch)
            }
            Tables::Normals(table) => self.fit_normals(table, scratch),
        };
        Ok(self.conclude(&fit, scratch))
    }

    /// The tilts of many images on `threads` threads, in the order of the images, the same whatever the number of threads.
    ///
    /// # Errors
    /// [`Error::InvalidOption`] for no threads at all, otherwise those of [`estimate`](Self::estimate), for the first image
    /// that has one.
    #[cfg(feature = "rayon")]
    pub fn estimate_many(&self, images: &[ImageView<'_>], threads: usize) -> Result<Vec<TiltEstimate>> {
        use rayon::prelude::*;
        if threads == 0 {
            return Err(Error::option("threads", threads, "at least 1"));
        }
        if threads == 1 || images.len() < 2 {
            let mut scratch = self.scratch();
            return images.iter().map(|image| self.estimate(image, &mut scratch)).collect();
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.min(images.len())).build().map_err(|error| {
            Error::option("threads", format!("{threads} ({error})"), "a number that the system can start")
        })?;
        // Collected in order first: a parallel collection into a `Result` returns whichever error it meets first.
        let answers: Vec<Result<TiltEstimate>> = pool.install(|| {
            images.par_iter().map_init(|| self.scratch(), |scratch, image| self.estimate(image, scratch)).collect()
        });
        answers.into_iter().collect()
    }

    /// The tilt of one image as [`estimate`](Self::estimate) gives it, and all its edge pixels. Allocates.
    ///
    /// # Errors
    /// Those of [`estimate`](Self::estimate).
    pub fn estimate_with_elements(
        &self,
        image: &ImageView<'_>,
        scratch: &mut Scratch,
    ) -> Result<(TiltEstimate, Vec<EdgeElement>)> {
        let estimate = self.estimate(image, scratch)?;
        let slots = scratch.edges.slot();
        let rows: Vec<(u32, bool)> = scratch
            .places
            .iter()
            .enumerate()
            .map(|(row, place)| (slots[*place as usize], scratch.is_inlier(row)))
            .collect();
        let mut all = EdgePixels::with_capacity(self.region.len());
        scratch.detector.detect(image, &self.region, None, &mut all);
        let centre = self.centre.as_ref().map_or((f32::NAN, f32::NAN), |c| (c.pixel.x as f32, c.pixel.y as f32));
        let mut rows = rows.into_iter().peekable();
        let elements = all.slot().iter().zip(all.gx()).zip(all.gy()).map(|((slot, gx), gy)| {
            let (u, v) = self.region.place(*slot as usize);
            let [cos, sin, s] = edge_offset(f32::from(u) - centre.0, f32::from(v) - centre.1, *gx, *gy);
            let row = rows.next_if(|(place, _)| place == slot);
            EdgeElement {
                u,
                v,
                phi_rad: f64::from(sin).atan2(f64::from(cos)),
                offset_px: f64::from(s),
                prefiltered: row.is_some(),
                inlier: row.is_some_and(|(_, inlier)| inlier),
            }
        });
        let elements = elements.collect();
        Ok((estimate, elements))
    }

    /// Paper 000 section 2.1.
    fn fit_offsets(&self, gains: &[f32], factor: f64, offset_max_px: f64, scratch: &mut Scratch) -> Fit {
        scratch.inliers = Inliers::None;
        let Some(centre) = &self.centre else { return Fit::none() };
        let Scratch { edges, rows, weights, places, .. } = &mut *scratch;
        offsets(edges, &self.region, centre, gains, offset_max_px, rows, weights, places);
        let problem = Offsets::new(rows);
        let upright = Vector2::zeros();
        let report: FitReport<Vector2<f64>> = match &self.options.method {
            Method::ImageSpaceRejectRefit { keep_fraction, .. } => {
                let options = RejectRefitOptions {
                    keep_fraction: *keep_fraction,
                    max_iterations: TRIMMING_ROUNDS,
                    tolerance: SHIFT_TOLERANCE_PX,
                    rms_min: 0.0,
                };
                reject_refit(&problem, &options, &upright, weights)
            }
            Method::ImageSpaceRansac { threshold_px, .. } => {
                let options = RansacOptions { seed: self.options.seed, ..RansacOptions::with_threshold(*threshold_px) };
                ransac(&problem, &options, &upright, weights)
            }
            Method::VectorConsensus { .. } | Method::Refined(_) => return Fit::none(),
        };
        let shift = report.model.unwrap_or_default();
        let (l, alpha) = (shift.norm(), shift.norm() / factor);
        if alpha >= FRAC_PI_2 {
            return Fit::out_of_reach(alpha, &report);
        }
        scratch.inliers = Inliers::weighted_if(report.model.is_some());
        let lean = if l > 0.0 { centre.lean(&(shift / l)) } else { upright };
        let lean = lean.try_normalize(1e-9).unwrap_or_default() * alpha.sin();
        let tilt = report.model.and_then(|_| Tilt::from_normal(&Vector3::new(lean.x, lean.y, alpha.cos())));
        Fit {
            tilt,
            model: [shift.x, shift.y, 1.0],
            gate: Gate::Soft { scale: STRAY_RAD * factor },
            horizontal: centre.direction() / factor,
            inliers: report.inliers,
            shift_px: report.model.map(|_| l),
            rms: report.rms,
            iterations: report.iterations,
            stop: report.stop,
        }
    }

    /// Paper 000 section 2.2, and the refined method.
    fn fit_normals(&self, table: &LiftTable, scratch: &mut Scratch) -> Fit {
        let Scratch { edges, rows, weights, places, sparse, inliers, .. } = &mut *scratch;
        *inliers = Inliers::None;
        table.lift(edges, self.options.normal_tilt_max_rad().sin(), rows, weights, places);
        let (report, gate, factor) = match &self.options.method {
            Method::VectorConsensus { threshold_rad, factor, .. } => {
                weights.fill(1.0);
                let report =
                    vector_consensus(rows, &self.robot_from_camera, *threshold_rad, self.options.seed, weights);
                *inliers = Inliers::weighted_if(report.model.is_some());
                (report, Gate::Soft { scale: STRAY_RAD }, *factor)
            }
            Method::Refined(options) => {
                let report = refine(rows, options, weights, sparse);
                *inliers = report.model.map_or(Inliers::None, |direction| Inliers::Within {
                    model: direction.into(),
                    threshold: 2.0 * options.scale_rad,
                });
                (report, Gate::Soft { scale: options.scale_rad }, 1.0)
            }
            Method::ImageSpaceRansac { .. } | Method::ImageSpaceRejectRefit { .. } => return Fit::none(),
        };
        let tilt = report.model.and_then(|normal| Tilt::from_normal(&normal));
        if let Some(alpha) = tilt.map(|tilt| tilt.alpha_rad() / factor).filter(|alpha| *alpha >= FRAC_PI_2) {
            *inliers = Inliers::None;
            return Fit::out_of_reach(alpha, &report);
        }
        let tilt = tilt.map(|tilt| {
            if factor == 1.0 { tilt } else { Tilt::from_alpha_beta(tilt.alpha_rad() / factor, tilt.beta_rad()) }
        });
        Fit {
            tilt,
            model: report.model.unwrap_or_default().into(),
            gate,
            horizontal: Matrix2::identity() / factor,
            inliers: match *inliers {
                Inliers::Within { model, threshold } => rows.count_within(model, threshold),
                Inliers::None | Inliers::Weighted => report.inliers,
            },
            shift_px: None,
            rms: report.rms,
            iterations: report.iterations,
            stop: report.stop,
        }
    }

    /// Adds covariance and confidence.
    fn conclude(&self, fit: &Fit, scratch: &Scratch) -> TiltEstimate {
        let slots = scratch.edges.slot();
        let sector = |row: usize| {
            let slot = scratch.places.get(row).and_then(|place| slots.get(*place as usize));
            slot.and_then(|slot| self.sectors.get(*slot as usize)).copied().unwrap_or(0)
        };
        // The paper's methods end with weights of what they have selected, which cannot tell how sure the selection was.
        let weights = matches!(self.options.method, Method::Refined(_)).then_some(&scratch.weights[..]);
        let covariance = fit.tilt.and_then(|tilt| {
            let covariance = confidence::clustered_covariance(
                &scratch.rows,
                fit.model,
                fit.gate,
                weights,
                self.region.pixels_per_rad(),
                sector,
            )?;
            // A change of the normal's horizontal part is a change in its tangent plane, seen along the vertical.
            let plane = tangent_basis(&tilt.normal()).fixed_rows::<2>(0).try_inverse()? * fit.horizontal;
            let covariance = plane * covariance * plane.transpose();
            let share = if self.options.method.is_exact() { 0.0 } else { confidence::APPROXIMATE_SHARE };
            Some(confidence::with_floor(confidence::with_lean_error(covariance, &tilt, share)))
        });
        TiltEstimate {
            tilt: fit.tilt,
            covariance_rad2: covariance.unwrap_or(Matrix2::from_diagonal_element(f64::INFINITY)),
            confidence: covariance.map_or(0.0, |covariance| confidence::confidence(&covariance)),
            edge_pixels: scratch.edges.strong(),
            prefiltered_pixels: scratch.rows.len(),
            inlier_pixels: fit.inliers,
            shift_px: fit.shift_px,
            residual_rms: fit.rms,
            iterations: fit.iterations,
            stop: fit.stop,
        }
    }
}

impl Scratch {
    /// Whether a row agreed with the last estimate.
    fn is_inlier(&self, row: usize) -> bool {
        match self.inliers {
            Inliers::None => false,
            Inliers::Weighted => self.weights.get(row).is_some_and(|weight| *weight > 0.0),
            Inliers::Within { model, threshold } => self.rows.is_within(row, model, threshold),
        }
    }
}

impl Fit {
    /// A fit with a lean that no image of a band of elevations can show.
    fn out_of_reach<M>(alpha: f64, report: &FitReport<M>) -> Self {
        let stop = Stop::OutOfReach { angle_rad: alpha, limit_rad: FRAC_PI_2 };
        Self { iterations: report.iterations, stop, ..Self::none() }
    }

    /// No fit at all: the method has no tables of this kind.
    fn none() -> Self {
        Self {
            tilt: None,
            model: [0.0; 3],
            gate: Gate::Open,
            horizontal: Matrix2::identity(),
            inliers: 0,
            shift_px: None,
            rms: f64::NAN,
            iterations: 0,
            stop: Stop::NoModel { trials: 0 },
        }
    }
}

/// # Errors
/// [`Error::InvalidArgument`] unless the matrix is a rotation to about 1e-6.
pub(super) fn validate_rotation(matrix: &Matrix3<f64>) -> Result<()> {
    let off = (matrix.transpose() * matrix - Matrix3::identity()).norm();
    if off < 1e-6 && matrix.determinant() > 0.0 {
        return Ok(());
    }
    let got = if matrix.iter().all(|x| x.is_finite()) {
        format!("a matrix with determinant {:.6} and |R^T R - I| = {off:.2e}", matrix.determinant())
    } else {
        "a matrix that is not finite".to_owned()
    };
    Err(Error::argument("robot_from_camera", got, "a rotation: orthonormal columns, determinant 1"))
}
