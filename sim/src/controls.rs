//! The controls of a simulated camera: what was asked, what it says, and what it does.

use std::time::Duration;

use coshade_capture::{Control, ControlInfo, ControlValue};

use crate::faults::{ControlFault, ControlName, Faults};
use crate::sensor::Exposure;
use crate::sensor::white_balance::channel_gains;
use crate::world::SensorSpec;

/// Shortest and longest exposure.
const EXPOSURE: [Duration; 2] = [Duration::from_micros(10), Duration::from_secs(1)];
const GAIN: [f64; 2] = [0.01, 100.0];
const WHITE_BALANCE_K: [f64; 2] = [1000.0, 40_000.0];

/// One control: what it reads back, and which value holds from which frame on.
#[derive(Clone, Debug)]
struct State {
    name: ControlName,
    default: ControlValue,
    shown: ControlValue,
    /// By rising frame.
    effective: Vec<(u64, ControlValue)>,
}

/// Why a control cannot be set.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Refusal {
    NoSuchControl,
    Refused(String),
}

/// All controls of a camera.
#[derive(Clone, Debug)]
pub(crate) struct Controls {
    states: Vec<State>,
    spec: SensorSpec,
    faults: Faults,
}

impl Controls {
    /// Of an image sensor, as it starts.
    pub(crate) fn new(spec: &SensorSpec, faults: &Faults) -> Self {
        let exposure = ControlValue::Time(Duration::from_secs_f64(spec.exposure_s));
        let mut start = vec![
            (ControlName::Exposure, exposure),
            (ControlName::Gain, ControlValue::Factor(spec.gain)),
            (ControlName::WhiteBalance, ControlValue::Kelvin(spec.white_balance_k)),
        ];
        if faults.pump(0.0).is_some() {
            start.push((ControlName::AutoExposure, ControlValue::Switch(true)));
        }
        let state = |(name, value)| State { name, default: value, shown: value, effective: vec![(0, value)] };
        Self { states: start.into_iter().map(state).collect(), spec: spec.clone(), faults: faults.clone() }
    }

    pub(crate) fn infos(&self) -> Vec<ControlInfo> {
        self.states.iter().map(|state| self.info(state)).collect()
    }

    fn info(&self, state: &State) -> ControlInfo {
        let [min, max] = range(state.name);
        ControlInfo {
            control: control(state.name),
            min,
            max,
            step: None,
            default: state.default,
            latency_frames: Some(self.spec.control_latency_frames),
            read_only: state.name == ControlName::Exposure && self.is_automatic(),
        }
    }

    /// What a control reads back.
    pub(crate) fn shown(&self, wanted: Control) -> Option<ControlValue> {
        self.states.iter().find(|state| control(state.name) == wanted).map(|state| state.shown)
    }

    /// Sets a control before frame `next_frame` is exposed; what it reads back then.
    pub(crate) fn set(
        &mut self,
        wanted: Control,
        value: ControlValue,
        next_frame: u64,
    ) -> Result<ControlValue, Refusal> {
        let automatic = self.is_automatic();
        let latency = u64::from(self.spec.control_latency_frames);
        let faults = &self.faults;
        let states = self.states.iter_mut();
        let state =
            states.into_iter().find(|state| control(state.name) == wanted).ok_or(Refusal::NoSuchControl)?;
        check(state.name, value).map_err(Refusal::Refused)?;
        if state.name == ControlName::Exposure && automatic {
            return Err(Refusal::Refused("automatic exposure is on; switch it off first".into()));
        }
        match faults.of_control(state.name) {
            Some(ControlFault::Ignores) => {}
            Some(ControlFault::Pretends) => state.shown = value,
            None => {
                state.shown = value;
                state.effective.push((next_frame.saturating_add(latency), value));
            }
        }
        Ok(state.shown)
    }

    /// Whether the device says that its exposure is automatic.
    fn is_automatic(&self) -> bool {
        self.shown(Control::AutoExposure) == Some(ControlValue::Switch(true))
    }

    /// What truly holds for a frame exposed at `time_s`.
    pub(crate) fn exposure(&self, frame: u64, time_s: f64) -> Exposure {
        let at = |wanted: ControlName| {
            let state = self.states.iter().find(|state| state.name == wanted)?;
            state.effective.iter().rev().find(|(from, _)| *from <= frame).map(|(_, value)| *value)
        };
        let mut exposure = Exposure::default();
        if let Some(ControlValue::Time(time)) = at(ControlName::Exposure) {
            exposure.time = time.as_secs_f64() / self.spec.exposure_s;
        }
        if let Some(ControlValue::Factor(gain)) = at(ControlName::Gain) {
            exposure.gain = gain / self.spec.gain;
        }
        if let Some(ControlValue::Kelvin(kelvin)) = at(ControlName::WhiteBalance) {
            exposure.white_balance = channel_gains(kelvin, self.spec.white_balance_k);
        }
        if at(ControlName::AutoExposure) == Some(ControlValue::Switch(true)) {
            exposure.time *= self.faults.pump(time_s).unwrap_or(1.0);
        }
        exposure
    }
}

fn control(name: ControlName) -> Control {
    match name {
        ControlName::Exposure => Control::Exposure,
        ControlName::Gain => Control::Gain,
        ControlName::WhiteBalance => Control::WhiteBalance,
        ControlName::AutoExposure => Control::AutoExposure,
    }
}

fn range(name: ControlName) -> [ControlValue; 2] {
    match name {
        ControlName::Exposure => EXPOSURE.map(ControlValue::Time),
        ControlName::Gain => GAIN.map(ControlValue::Factor),
        ControlName::WhiteBalance => WHITE_BALANCE_K.map(ControlValue::Kelvin),
        ControlName::AutoExposure => [false, true].map(ControlValue::Switch),
    }
}

fn check(name: ControlName, value: ControlValue) -> Result<(), String> {
    let within = |ok: bool, allowed: String| if ok { Ok(()) } else { Err(format!("allowed: {allowed}")) };
    let range = |[low, high]: [f64; 2], value: f64, unit: &str| {
        within((low..=high).contains(&value), format!("{low} to {high}{unit}"))
    };
    match (name, value) {
        (ControlName::Exposure, ControlValue::Time(time)) => {
            let [low, high] = EXPOSURE;
            within((low..=high).contains(&time), format!("{low:?} to {high:?}"))
        }
        (ControlName::Gain, ControlValue::Factor(gain)) => range(GAIN, gain, ""),
        (ControlName::WhiteBalance, ControlValue::Kelvin(kelvin)) => range(WHITE_BALANCE_K, kelvin, " K"),
        (ControlName::AutoExposure, ControlValue::Switch(_)) => Ok(()),
        _ => Err("a value of another kind".into()),
    }
}
