//! The macros that declare options.

/// Declares a struct of options: every field once, with its doc, type, default and domain.
///
/// ```
/// use tiltvp_core::options::{Kind, Options, POSITIVE, Value};
///
/// tiltvp_core::words! {
///     /// What is fitted.
///     pub enum Shape {
///         /// A circle.
///         Circle = "circle",
///         /// An ellipse.
///         Ellipse = "ellipse",
///     }
/// }
///
/// tiltvp_core::options! {
///     /// Options of a fit.
///     pub struct FitOptions {
///         /// What is fitted.
///         shape: Shape = Shape::Circle;
///         /// Largest residual of an inlier in pixels.
///         threshold_px: f64 = 1.5 => POSITIVE, "a positive number of pixels";
///     }
/// }
///
/// let mut options = FitOptions::default();
/// options.set("shape", &Value::Text("ellipse".into())).unwrap();
/// options.set("threshold_px", &Value::Float(-2.0)).unwrap();
/// assert_eq!(options.shape, Shape::Ellipse);
/// let refusal = options.validate().unwrap_err().to_string();
/// assert_eq!(refusal, "option threshold_px = -2, expected a positive number of pixels");
/// let refusal = options.set("treshold_px", &Value::Float(1.0)).unwrap_err().to_string();
/// assert!(refusal.contains("did you mean threshold_px?"), "{refusal}");
/// ```
///
/// A field may begin with what part it has of the whole:
/// - `[flat]` or `[flat "prefix_"]`: options of their own, whose fields stand among those here, under a longer name;
/// - `[flat except "name" "name"]`: the same without some, which keep their defaults;
/// - `[switch "name" "prefix_"]`: an `Option` of options, which the switch of that name turns on;
/// - `[as "name"]` or `[as "name" by Type]`: an option under another name, and written and read as another type that it is
///   made into and from;
/// - `[where path, "words"]`: an option only where the function says so of the options; the words say in a refusal whose it is.
///
/// After `=>` stands the domain of its numbers (a range, [`Above`](crate::options::Above),
/// [`Between`](crate::options::Between) or a closure of the options and the number) and the domain in words. After the struct
/// may stand `check path`: a function of the options that refuses what no domain tells.
#[macro_export]
macro_rules! options {
    (
        $(#[$meta:meta])*
        $vis:vis struct $Name:ident {
            $(
                $(#[doc = $doc:literal])*
                $([$($part:tt)*])?
                $field:ident : $type:ty = $default:expr $(=> $domain:expr, $expected:literal)? ;
            )*
        }
        $(check $check:path)?
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq)]
        $vis struct $Name {
            $(
                $(#[doc = $doc])*
                #[doc = concat!("\n\nDefault: `", stringify!($default), "`", $("; expected: ", $expected,)? ".")]
                pub $field: $type,
            )*
        }

        impl Default for $Name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $Name {
            /// Checks every field.
            ///
            /// # Errors
            /// `Error::InvalidOption` with the name of the first field outside its domain.
            $vis fn validate(&self) -> $crate::Result<()> {
                $crate::options::Options::validate(self)
            }
        }

        impl $crate::options::Options for $Name {
            fn fields(&self) -> Vec<$crate::options::Field> {
                let mut out = Vec::new();
                $($crate::option_part! {
                    @fields [$($($part)*)?] self, $field, $type, out, [$($doc),*], [$($domain, $expected)?]
                })*
                out
            }

            fn try_set(&mut self, name: &str, value: &$crate::options::Value) -> $crate::Result<bool> {
                $($crate::option_part! { @set [$($($part)*)?] self, $field, $type, name, value })*
                Ok(false)
            }

            fn validate(&self) -> $crate::Result<()> {
                $($crate::option_part! { @validate [$($($part)*)?] self, $field, $type, [$($domain, $expected)?] })*
                $($check(self)?;)?
                Ok(())
            }

            fn method(&self) -> Option<&'static str> {
                None$(.or($crate::option_choice! { @method [$($($part)*)?] self, $field }))*
            }

            fn elsewhere(&self, name: &str) -> Option<String> {
                let _ = name;
                None$(.or_else(|| $crate::option_choice! { @elsewhere [$($($part)*)?] self, $field, name }))*
            }
        }
    };
}

/// What [`options!`] writes for one field, by the part that it has of the whole.
#[doc(hidden)]
#[macro_export]
macro_rules! option_part {
    // A plain option, under a name and by a type that its value is written and read by.
    (@fields [leaf $name:expr, $by:ty]
        $self:ident, $field:ident, $type:ty, $out:ident, [$($doc:literal),*], [$($domain:expr, $expected:literal)?]) => {
        let expected: Option<&'static str> = None$(.or(Some($expected)))?;
        let kind = <$by as $crate::options::OptionValue>::KIND;
        $out.push($crate::options::Field {
            name: $name.into(),
            doc: $crate::options::doc(&[$($doc),*]),
            kind,
            value: $crate::options::value_by::<$type, $by>(&$self.$field),
            expected: expected.map_or_else(|| kind.to_string().into(), Into::into),
        });
    };
    (@set [leaf $name:expr, $by:ty] $self:ident, $field:ident, $type:ty, $asked:ident, $value:ident) => {
        if $asked == $name {
            $crate::options::assign_by::<$type, $by>(&mut $self.$field, $name, $value)?;
            return Ok(true);
        }
    };
    (@validate [leaf $name:expr, $by:ty] $self:ident, $field:ident, $type:ty, []) => {};
    (@validate [leaf $name:expr, $by:ty] $self:ident, $field:ident, $type:ty, [$domain:expr, $expected:literal]) => {
        let value = $crate::options::value_by::<$type, $by>(&$self.$field);
        $crate::options::check($self, $name, &value, &$domain, $expected)?;
    };
    (@$what:ident [] $self:ident, $field:ident, $type:ty, $($rest:tt)*) => {
        $crate::option_part! { @$what [leaf stringify!($field), $type] $self, $field, $type, $($rest)* }
    };
    (@$what:ident [as $name:literal] $self:ident, $field:ident, $type:ty, $($rest:tt)*) => {
        $crate::option_part! { @$what [leaf $name, $type] $self, $field, $type, $($rest)* }
    };
    (@$what:ident [as $name:literal by $by:ty] $self:ident, $field:ident, $type:ty, $($rest:tt)*) => {
        $crate::option_part! { @$what [leaf $name, $by] $self, $field, $type, $($rest)* }
    };
    // An option only where a function says so.
    (@$what:ident [where $is:path, $words:literal] $self:ident, $($rest:tt)*) => {
        if $is($self) { $crate::option_part! { @$what [] $self, $($rest)* } }
    };

    // Options of their own, flat among those here.
    (@$what:ident [flat] $($rest:tt)*) => { $crate::option_part! { @$what [flat ""] $($rest)* } };
    (@fields [flat except $($not:literal)+] $self:ident, $field:ident, $type:ty, $out:ident, $($rest:tt)*) => {
        let fields = $crate::options::Options::fields(&$self.$field);
        $out.extend(fields.into_iter().filter(|field| ![$($not),+].contains(&&*field.name)));
    };
    (@set [flat except $($not:literal)+] $self:ident, $field:ident, $type:ty, $asked:ident, $value:ident) => {
        if ![$($not),+].contains(&$asked) && $crate::options::Options::try_set(&mut $self.$field, $asked, $value)? {
            return Ok(true);
        }
    };
    (@validate [flat except $($not:literal)+] $($rest:tt)*) => {
        $crate::option_part! { @validate [flat ""] $($rest)* }
    };
    (@fields [flat $prefix:literal]
        $self:ident, $field:ident, $type:ty, $out:ident, [$($doc:literal),*], []) => {
        let fields = $crate::options::Options::fields(&$self.$field);
        $out.extend(fields.into_iter().map(|field| $crate::options::prefixed($prefix, field)));
    };
    (@set [flat $prefix:literal] $self:ident, $field:ident, $type:ty, $asked:ident, $value:ident) => {
        if let Some(own) = $asked.strip_prefix($prefix)
            && $crate::options::Options::try_set(&mut $self.$field, own, $value)
                .map_err(|error| error.of_option($prefix))?
        {
            return Ok(true);
        }
    };
    (@validate [flat $prefix:literal] $self:ident, $field:ident, $type:ty, []) => {
        $crate::options::Options::validate(&$self.$field).map_err(|error| error.of_option($prefix))?;
    };

    // Options that a switch turns on.
    (@fields [switch $switch:literal $prefix:literal]
        $self:ident, $field:ident, $type:ty, $out:ident, [$($doc:literal),*], []) => {
        $out.push($crate::options::Field {
            name: $switch.into(),
            doc: $crate::options::doc(&[$($doc),*]),
            kind: $crate::options::Kind::Bool,
            value: $crate::options::Value::Bool($self.$field.is_some()),
            expected: $crate::options::Kind::Bool.to_string().into(),
        });
        if let Some(own) = &$self.$field {
            let fields = $crate::options::Options::fields(own);
            $out.extend(fields.into_iter().map(|field| $crate::options::prefixed($prefix, field)));
        }
    };
    (@set [switch $switch:literal $prefix:literal] $self:ident, $field:ident, $type:ty, $asked:ident, $value:ident) => {
        if $asked == $switch {
            let mut on = $self.$field.is_some();
            $crate::options::assign(&mut on, $switch, $value)?;
            $self.$field = if on { Some($self.$field.take().unwrap_or_default()) } else { None };
            return Ok(true);
        }
        if let (Some(own), Some(options)) = ($asked.strip_prefix($prefix), &mut $self.$field)
            && $crate::options::Options::try_set(options, own, $value).map_err(|error| error.of_option($prefix))?
        {
            return Ok(true);
        }
    };
    (@validate [switch $switch:literal $prefix:literal] $self:ident, $field:ident, $type:ty, []) => {
        if let Some(own) = &$self.$field {
            $crate::options::Options::validate(own).map_err(|error| error.of_option($prefix))?;
        }
    };
}

/// What [`options!`] asks one field for whose options may be those of a method.
#[doc(hidden)]
#[macro_export]
macro_rules! option_choice {
    (@method [flat $($prefix:literal)?] $self:ident, $field:ident) => {
        $crate::options::Options::method(&$self.$field)
    };
    (@elsewhere [flat $($prefix:literal)?] $self:ident, $field:ident, $asked:ident) => {
        Some($asked)$(.and_then(|asked| asked.strip_prefix($prefix)))?
            .and_then(|own| $crate::options::Options::elsewhere(&$self.$field, own))
    };
    (@elsewhere [switch $switch:literal $prefix:literal] $self:ident, $field:ident, $asked:ident) => {
        ($self.$field.is_none() && $asked.starts_with($prefix)).then(|| format!("given without {}=True", $switch))
    };
    (@elsewhere [where $is:path, $words:literal] $self:ident, $field:ident, $asked:ident) => {
        ($asked == stringify!($field) && !$is($self)).then(|| $words.to_owned())
    };
    (@$what:ident [$($part:tt)*] $($rest:tt)*) => { None };
}

/// Declares a choice among words: each variant is an option's value by its word.
#[macro_export]
macro_rules! words {
    (
        $(#[$meta:meta])*
        $vis:vis enum $Name:ident {
            $($(#[$variant_meta:meta])* $Variant:ident = $word:literal),+ $(,)?
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        $vis enum $Name {
            $($(#[$variant_meta])* $Variant,)+
        }

        impl $Name {
            /// Every choice, in the order of declaration.
            pub const ALL: [Self; [$($word),+].len()] = [$(Self::$Variant),+];

            /// The word of every choice, in the order of declaration.
            pub const NAMES: &'static [&'static str] = &[$($word),+];

            /// The word of the choice.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$Variant => $word,)+
                }
            }

            /// The choice of a word.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|choice| choice.name() == name)
            }
        }

        impl $crate::options::OptionValue for $Name {
            const KIND: $crate::options::Kind = $crate::options::Kind::Word(Self::NAMES);

            fn to_value(&self) -> $crate::options::Value {
                $crate::options::Value::Text(self.name().to_owned())
            }

            fn from_value(value: &$crate::options::Value) -> Option<Self> {
                if let $crate::options::Value::Text(name) = value { Self::from_name(name) } else { None }
            }
        }
    };
}

/// Declares a choice among methods, each with options of its own; the first is the default.
#[macro_export]
macro_rules! methods {
    (
        $(#[$meta:meta])*
        $vis:vis enum $Name:ident {
            $($(#[$variant_meta:meta])* $Variant:ident($Own:ty) = $word:literal),+ $(,)?
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq)]
        $vis enum $Name {
            $($(#[$variant_meta])* $Variant($Own),)+
        }

        impl $Name {
            /// The name of every method, the default first.
            pub const NAMES: &'static [&'static str] = &[$($word),+];

            /// The name of the method.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$Variant(_) => $word,)+
                }
            }

            /// The method of that name with its defaults.
            ///
            /// # Errors
            /// `Error::InvalidOption` with the names there are, for any other.
            pub fn from_name(name: &str) -> $crate::Result<Self> {
                match name {
                    $($word => Ok(Self::$Variant(<$Own>::default())),)+
                    _ => {
                        let expected = $crate::options::Kind::Word(Self::NAMES).to_string();
                        Err($crate::Error::option("method", format!("{name:?}"), expected))
                    }
                }
            }
        }

        impl $crate::options::Options for $Name {
            fn fields(&self) -> Vec<$crate::options::Field> {
                match self {
                    $(Self::$Variant(own) => $crate::options::Options::fields(own),)+
                }
            }

            fn try_set(&mut self, name: &str, value: &$crate::options::Value) -> $crate::Result<bool> {
                match self {
                    $(Self::$Variant(own) => $crate::options::Options::try_set(own, name, value),)+
                }
            }

            fn validate(&self) -> $crate::Result<()> {
                match self {
                    $(Self::$Variant(own) => $crate::options::Options::validate(own),)+
                }
            }

            fn method(&self) -> Option<&'static str> {
                Some(self.name())
            }

            fn elsewhere(&self, name: &str) -> Option<String> {
                let mut methods = Vec::new();
                $(if $crate::options::Options::get(&<$Own>::default(), name).is_some() {
                    methods.push(concat!("\"", $word, "\""));
                })+
                (!methods.is_empty()).then(|| format!("it is one of method {}", methods.join(" and ")))
            }
        }
    };
}
