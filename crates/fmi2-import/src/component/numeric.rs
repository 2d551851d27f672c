//! The C types whose values are numbers, with their functions.

use std::ffi::c_void;
use std::fmt::Debug;

use fmi2_sys::fmi2Status as Status;

use crate::functions::{Call, Functions};
use crate::per_type::CType;
use crate::request::Values;

type Getter<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut T) -> Status;
type Setter<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const T) -> Status;

/// A C type whose values are numbers.
pub(crate) trait Numeric {
    type Value: Copy + Default + Debug;
    const TYPE: CType;
    const GET: Call;
    const SET: Call;
    fn getter(functions: &Functions) -> Option<Getter<Self::Value>>;
    fn setter(functions: &Functions) -> Option<Setter<Self::Value>>;
    /// The values as they are sent to another process.
    fn wrap(values: Vec<Self::Value>) -> Values;
    /// The values as they came from another process.
    fn unwrap(values: &Values) -> Option<&[Self::Value]>;
}

macro_rules! numeric {
    ($($kind:ident of $value:ty: $get:ident $getter:ident, $set:ident $setter:ident;)*) => {$(
        pub(crate) struct $kind;

        impl Numeric for $kind {
            type Value = $value;
            const TYPE: CType = CType::$kind;
            const GET: Call = Call::$get;
            const SET: Call = Call::$set;
            #[inline]
            fn getter(functions: &Functions) -> Option<Getter<$value>> {
                functions.$getter
            }
            #[inline]
            fn setter(functions: &Functions) -> Option<Setter<$value>> {
                functions.$setter
            }
            fn wrap(values: Vec<$value>) -> Values {
                Values::$kind(values)
            }
            fn unwrap(values: &Values) -> Option<&[$value]> {
                match values {
                    Values::$kind(values) => Some(values),
                    _ => None,
                }
            }
        }
    )*};
}

numeric! {
    Real of f64: fmi2GetReal get_real, fmi2SetReal set_real;
    Integer of i32: fmi2GetInteger get_integer, fmi2SetInteger set_integer;
    Boolean of i32: fmi2GetBoolean get_boolean, fmi2SetBoolean set_boolean;
}
