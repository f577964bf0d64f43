//! What a page of diagnostics shows (manuals, section 4.1.4), out of the object dictionary. How it looks is the dialect's
//! business.

use super::Firmware;
use crate::device::SensorKind;
use crate::emulator::Board;
use crate::emulator::dialect::{ChannelDiagnosis, Diagnosis, Quantity};
use crate::emulator::measurement;
use crate::wire::stream::{Row, Source};

impl Firmware {
    /// The present values.
    pub(super) fn diagnosis(&self, board: &Board<'_>) -> Diagnosis {
        let objects = &self.objects;
        let sensors = board.product.measurement.sensors;
        let layout = &board.product.stream;
        let quantity = |name, index, decimals, unit| Quantity { name, value: objects.number(index, 0), decimals, unit };
        let unit = vec![
            quantity("Supply Voltage", 0x5000, 2, "V"),
            match sensors {
                SensorKind::Thermocouple => quantity("Cold Junction", 0x3100, 3, "C"),
                SensorKind::Rtd => quantity("Source Current", 0x5001, 3, "mA"),
            },
        ];
        let row = measurement::row(objects, Source::FieldValue);
        // A row may begin with the cold junction, which is not a channel.
        let before = row.readings.len() - usize::from(board.product.measurement.channels);
        let inputs = layout.channels.iter().zip(&row.readings).skip(before);
        let channels = (1u8..).zip(inputs).map(|(number, (name, reading))| ChannelDiagnosis {
            name: name.clone(),
            field_value: layout.emit(&Row { readings: vec![*reading], ..row }),
            process_value: objects.integer(0x7130, number),
            status: objects.integer(0x6150, number) as u8,
            microvolts: objects.integer(0x2010, number),
            ohm: (sensors == SensorKind::Rtd).then(|| objects.number(0x2000, number)),
        });
        Diagnosis {
            unit,
            channels: channels.collect(),
            errors: self.errors.count(),
            uptime: board.now.since(self.started_at),
            network: self.network.state(),
        }
    }
}
