//! Arrays of NumPy, in and out.

use faer::MatRef;
use mesh::MeshError;
use numpy::{
    Element, IntoPyArray, PyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyUntypedArray, PyUntypedArrayMethods,
    ndarray::{ArrayView, ArrayView2, Dimension, ShapeBuilder},
};
use pyo3::{
    PyClass,
    conversion::FromPyObjectOwned,
    exceptions::{PyTypeError, PyValueError},
    prelude::*,
    pyclass::boolean_struct::True,
    types::PyDict,
};

use crate::errors::Failure;

/// Points, (n, 3), float64 or what becomes float64 without loss; copied once.
pub(crate) fn points(array: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<[f64; 3]>> {
    let array = rows_of_three(array, name, "n")?;
    if !"fiu".contains(kind(&array)?) {
        return Err(PyTypeError::new_err(format!(
            "{name} has dtype {}; coordinates are floating-point numbers",
            array.dtype()
        )));
    }
    let array: PyReadonlyArray2<'_, f64> = contiguous(&array, "float64")?;
    Ok(array.as_slice()?.as_chunks::<3>().0.to_vec())
}

/// Triangles, (m, 3), of any integer type; copied once. `count` is how many vertices there are.
pub(crate) fn triangles(array: &Bound<'_, PyAny>, name: &str, count: usize) -> PyResult<Vec<[u32; 3]>> {
    let array = rows_of_three(array, name, "m")?;
    if !"iu".contains(kind(&array)?) {
        return Err(PyTypeError::new_err(format!(
            "{name} has dtype {}; indices are integers, such as int64",
            array.dtype()
        )));
    }
    if array.dtype().to_string() == "int32" {
        let array: PyReadonlyArray2<'_, i32> = contiguous(&array, "int32")?;
        return indices(array.as_slice()?, name, count);
    }
    let array: PyReadonlyArray2<'_, i64> = contiguous(&array, "int64")?;
    indices(array.as_slice()?, name, count)
}

fn indices<T: Copy + Into<i64>>(flat: &[T], name: &str, count: usize) -> PyResult<Vec<[u32; 3]>> {
    let mut triangles = Vec::with_capacity(flat.len() / 3);
    for (triangle, corners) in flat.as_chunks::<3>().0.iter().enumerate() {
        let corners = corners.map(Into::into);
        if let Some(index) = corners.iter().find(|&&v| v < 0) {
            return Err(PyValueError::new_err(format!(
                "{name}[{triangle}] has the index {index}; indices start at 0"
            )));
        }
        if let Some(&vertex) = corners.iter().find(|&&v| v >= count as i64) {
            let error = MeshError::IndexOutOfRange {
                triangle,
                vertex: vertex.unsigned_abs(),
                count,
            };
            return Err(Failure::from(error).into());
        }
        triangles.push(corners.map(|v| v as u32));
    }
    Ok(triangles)
}

/// Numbers, (n,), float64.
pub(crate) fn numbers(array: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let array = as_array(array)?;
    if array.ndim() != 1 {
        return Err(wrong_shape(&array, name, "(n,)"));
    }
    let array: PyReadonlyArray1<'_, f64> = contiguous(&array, "float64")?;
    Ok(array.as_slice()?.to_vec())
}

/// Indices as scipy has them, (n,), of any integer type.
pub(crate) fn counts(array: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    let array: PyReadonlyArray1<'_, i64> = contiguous(&as_array(array)?, "int64")?;
    let count = |&i: &i64| usize::try_from(i).map_err(|_| PyValueError::new_err("an index below 0"));
    array.as_slice()?.iter().map(count).collect()
}

fn as_array<'py>(object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    let array = object.py().import("numpy")?.call_method1("asarray", (object,))?;
    Ok(array.cast_into()?)
}

fn rows_of_three<'py>(
    object: &Bound<'py, PyAny>,
    name: &str,
    rows: &str,
) -> PyResult<Bound<'py, PyUntypedArray>> {
    let array = as_array(object)?;
    match array.shape() {
        [_, 3] => Ok(array),
        _ => Err(wrong_shape(&array, name, &format!("({rows}, 3)"))),
    }
}

fn wrong_shape(array: &Bound<'_, PyUntypedArray>, name: &str, needed: &str) -> PyErr {
    let shape: Vec<String> = array.shape().iter().map(ToString::to_string).collect();
    let comma = if shape.len() == 1 { "," } else { "" };
    PyValueError::new_err(format!(
        "{name} has the shape ({}{comma}); {needed} is needed",
        shape.join(", ")
    ))
}

/// What an array holds, as NumPy abbreviates it: "f" for floating-point numbers, "i" and "u" for integers.
fn kind(array: &Bound<'_, PyUntypedArray>) -> PyResult<char> {
    array.dtype().getattr("kind")?.extract()
}

/// The array itself if it is of this type, aligned and in the order of C, or else a copy that is.
fn contiguous<'py, A: FromPyObjectOwned<'py, Error: Into<PyErr>>>(
    array: &Bound<'py, PyUntypedArray>,
    dtype: &str,
) -> PyResult<A> {
    let numpy = array.py().import("numpy")?;
    let options = PyDict::new(array.py());
    options.set_item("dtype", dtype)?;
    options.set_item("requirements", ["C", "A"])?;
    let array = numpy.call_method("require", (array,), Some(&options))?;
    array.extract().map_err(Into::into)
}

/// An array of numbers that becomes NumPy's as it is.
pub(crate) fn owned<T: Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    values.into_pyarray(py)
}

/// Rows of N numbers, which become NumPy's as they are.
pub(crate) fn owned_rows<T: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let shape = [rows.len(), N];
    rows.into_flattened().into_pyarray(py).reshape(shape)
}

/// A read-only array over memory of a result, which lives as long as the array does: nothing is copied.
#[allow(unsafe_code)]
pub(crate) fn view<'py, K, D>(
    owner: &Bound<'py, K>,
    kept: impl for<'a> FnOnce(&'a K) -> ArrayView<'a, f64, D>,
) -> Bound<'py, PyArray<f64, D>>
where
    K: PyClass<Frozen = True> + Sync,
    D: Dimension,
{
    let array = kept(owner.get());
    // SAFETY: `kept` borrows from any `&K`, so the memory is the owner's and stays as it is while the owner is not borrowed mutably, which the
    // class, being frozen, never is, or dropped, which the array prevents: it holds a reference. Nobody writes: the array becomes read-only here,
    // and NumPy does not let it become writeable again, since its base is no buffer.
    let view = unsafe { PyArray::borrow_from_array(&array, owner.clone().into_any()) };
    view.readwrite().make_nonwriteable();
    view
}

/// Points as an array, (n, 3).
pub(crate) fn rows(points: &[[f64; 3]]) -> ArrayView2<'_, f64> {
    ArrayView2::from(points)
}

/// The columns of a matrix as an array, (rows, columns).
#[allow(unsafe_code)]
pub(crate) fn columns(matrix: MatRef<'_, f64>) -> ArrayView2<'_, f64> {
    let shape = (matrix.nrows(), matrix.ncols());
    let strides = (
        matrix.row_stride().unsigned_abs(),
        matrix.col_stride().unsigned_abs(),
    );
    // SAFETY: the matrix is borrowed for as long as the array, has this shape, and its strides, of a matrix that owns its memory, are positive.
    unsafe { ArrayView2::from_shape_ptr(shape.strides(strides), matrix.as_ptr()) }
}
